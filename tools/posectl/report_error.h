#pragma once

#include <ostream>

#include <fmt/ostream.h>

#include "core/result.h"
#include "tools/posectl/exit_code.h"

namespace posed {

/// Prints the error for the person at the terminal and returns the exit code that stands for it. Reentrant.
inline ExitCode report_error(std::ostream& err, const Error& error) {
  fmt::print(err, "posectl: {}\n", error.message);
  return exit_code_of(error.code);
}

}  // namespace posed
