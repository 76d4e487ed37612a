#pragma once

#include <string_view>

#include "core/result.h"

/// What the programs' exit codes mean: those of <sysexits.h>, so that a service manager can tell a mistake in the configuration,
/// which no restart mends, from a device that may come back.
namespace posed {

/// The exit code for an error that ended the program. Reentrant.
int exit_code(ErrorCode code) noexcept;

/// The table of exit codes for `--help`, a line each.
std::string_view exit_code_table() noexcept;

}  // namespace posed
