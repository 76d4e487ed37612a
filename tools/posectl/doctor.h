#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "config/config.h"

/// What of a machine hinders the daemon, and how to mend it. Reentrant.
namespace posed {

enum class Verdict {
  Good,
  Advice,  ///< it runs, and could run better
  Bad,     ///< something will not work
};

struct Finding {
  Verdict verdict = Verdict::Good;
  std::string subject;  ///< "locked memory"
  std::string found;    ///< what is the case
  std::string mend;     ///< what to do about it; empty where it is good
};

/// What the kernel says of the machine, read below `root` ("/" but in tests), and the limits that the daemon would run under.
struct Machine {
  std::filesystem::path root = "/";
  std::uint64_t locked_memory_limit = 0;  ///< bytes; UINT64_MAX: none
  std::uint64_t real_time_priority_limit = 0;
  bool is_root = false;  ///< no limit holds
};

/// The machine that this runs on, with the limits of the service where its unit is installed, and else of this process.
Machine this_machine();

std::vector<Finding> examine_limits(const Machine& machine, const Config& config);
std::vector<Finding> examine_kernel(const Machine& machine);
std::vector<Finding> examine_network(const Machine& machine, const Config& config);
std::vector<Finding> examine_devices(const Machine& machine, const Config& config);
std::vector<Finding> examine_calibration(const Config& config);

}  // namespace posed
