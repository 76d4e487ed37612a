#include <algorithm>
#include <filesystem>
#include <memory>
#include <ostream>
#include <string_view>

#include <CLI/CLI.hpp>
#include <fmt/ostream.h>

#include "config/config_loader.h"
#include "tools/posectl/commands.h"
#include "tools/posectl/doctor.h"
#include "tools/posectl/exit_code.h"
#include "tools/posectl/report_error.h"

namespace posed {
namespace {

std::string_view mark(Verdict verdict) {
  switch (verdict) {
    case Verdict::Good: return "good";
    case Verdict::Advice: return "could be better";
    case Verdict::Bad: break;
  }
  return "BAD";
}

/// How many are bad.
int print(const std::vector<Finding>& findings, const Console& console) {
  for (const Finding& finding : findings) {
    fmt::print(console.out, "{:<15}  {}: {}\n", mark(finding.verdict), finding.subject, finding.found);
    if (!finding.mend.empty()) {
      fmt::print(console.out, "{:<15}  -> {}\n", "", finding.mend);
    }
  }
  return static_cast<int>(
      std::count_if(findings.begin(), findings.end(), [](const Finding& f) { return f.verdict == Verdict::Bad; }));
}

int run_doctor(const std::filesystem::path& path, const Console& console) {
  const Result<Config> config = path.empty() ? default_config() : load_config(path);
  if (!config) {
    return report_error(console.err, config.error());
  }
  const Machine machine = this_machine();
  int bad = 0;
  bad += print(examine_limits(machine, *config), console);
  bad += print(examine_kernel(machine), console);
  bad += print(examine_network(machine, *config), console);
  bad += print(examine_devices(machine, *config), console);
  bad += print(examine_calibration(*config), console);
  return bad == 0 ? kExitOk : kExitNegative;
}

}  // namespace

void add_doctor_command(CLI::App& parent, const Console& console, int& exit_code) {
  auto path = std::make_shared<std::filesystem::path>();
  CLI::App* command = parent.add_subcommand(
      "doctor", "Examine this machine: limits, kernel, network, devices, calibration; say how to mend what hinders the daemon");
  command->add_option("--config", *path, "The daemon's configuration (TOML); without it the built-in defaults")->type_name("FILE");
  command->callback([path, &console, &exit_code] { exit_code = run_doctor(*path, console); });
}

}  // namespace posed
