#pragma once

#include <string>
#include <vector>

#include "tools/posectl/commands.h"

namespace posed {

/// The whole program but for `main`: runs `posectl ARGUMENTS...` and returns its exit code (see exit_code.h). Lets no exception
/// out. Thread-bound; replay, synth, record and watch catch SIGINT and SIGTERM while they run.
int run_posectl(std::vector<std::string> arguments, const Console& console);

}  // namespace posed
