#include <ostream>

#include <CLI/CLI.hpp>
#include <fmt/ostream.h>

#include "daemon/version.h"
#include "tools/posectl/commands.h"
#include "tools/posectl/exit_code.h"

namespace posed {

void add_version_command(CLI::App& parent, const Console& console, int& exit_code) {
  parent.add_subcommand("version", "Print the version")->callback([&console, &exit_code] {
    fmt::print(console.out, "posectl {}\n", version());
    exit_code = kExitOk;
  });
}

}  // namespace posed
