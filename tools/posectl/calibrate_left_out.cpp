#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "tools/posectl/commands.h"
#include "tools/posectl/report_error.h"

namespace posed {

/// Stands in for calibrate_command.cpp where OpenCV's calib3d was not there to build with.
void add_calibrate_command(CLI::App& parent, const Console& console, int& exit_code) {
  CLI::App* command = parent.add_subcommand("calibrate", "Left out of this build: install libopencv-calib3d-dev and build again");
  command->allow_extras();
  command->callback([&console, &exit_code] {
    exit_code = report_error(console.err, {ErrorCode::Unsupported,
                                           "this build was made without OpenCV's calib3d; install "
                                           "libopencv-calib3d-dev and build again"});
  });
}

}  // namespace posed
