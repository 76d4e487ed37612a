#include "tools/posectl/doctor.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <limits>
#include <optional>
#include <sstream>
#include <string_view>
#include <unistd.h>

#include <fmt/format.h>
#include <sys/resource.h>

namespace posed {

namespace {

constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

/// First line of a file below the machine's root; nothing where it cannot be read.
std::optional<std::string> line_of(const Machine& machine, std::string_view path) {
  std::ifstream file(machine.root / path);
  std::string line;
  if (!std::getline(file, line)) {
    return std::nullopt;
  }
  return line;
}

std::optional<std::uint64_t> number_in(std::string_view text, int base = 10) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  return error == std::errc() && end != text.data() ? std::optional(value) : std::nullopt;
}

/// "LimitRTPRIO=50" and "LimitMEMLOCK=infinity" of the service's unit stand in for this process's own limits.
void read_unit_limits(Machine& machine) {
  std::ifstream unit(machine.root / "lib/systemd/system/posed.service");
  std::string line;
  while (std::getline(unit, line)) {
    const std::string_view value = std::string_view(line).substr(std::min(line.size(), line.find('=') + 1));
    const std::uint64_t limit = value == "infinity" ? kUnlimited : number_in(value).value_or(0);
    if (line.starts_with("LimitRTPRIO=")) {
      machine.real_time_priority_limit = limit;
    } else if (line.starts_with("LimitMEMLOCK=")) {
      machine.locked_memory_limit = limit;
    }
  }
}

int highest_priority(const Config& config) {
  int highest = 0;
  const PipelineConfig& p = config.pipeline;
  for (const ThreadConfig* thread : {&p.capture, &p.tracker, &p.mapper, &p.detector, &p.publisher}) {
    highest = thread->policy == ThreadPolicyName::Fifo ? std::max(highest, thread->priority) : highest;
  }
  return highest;
}

/// A line of /proc/net/route: is the interface up, and does the route lead to 239.255.76.67 or any other multicast group?
bool leads_to_multicast(const std::string& line) {
  std::istringstream fields(line);
  std::string interface, destination, gateway, flags, references, use, metric, mask;
  fields >> interface >> destination >> gateway >> flags >> references >> use >> metric >> mask;
  const auto target = number_in(destination, 16);
  const auto bits = number_in(mask, 16);
  const auto flag_bits = number_in(flags, 16);
  constexpr std::uint64_t kUp = 1;
  constexpr std::uint64_t kGroup = 0x434CFFEF;  // 239.255.76.67 as the kernel prints it on a little-endian machine
  return target && bits && flag_bits && (*flag_bits & kUp) != 0 && (kGroup & *bits) == *target;
}

Finding device_finding(const Machine& machine, const std::string& subject, const std::string& path) {
  const std::filesystem::path file = machine.root / std::filesystem::path(path).relative_path();
  std::error_code error;
  if (!std::filesystem::exists(file, error)) {
    return {Verdict::Bad, subject, fmt::format("{} does not exist", path),
            "posectl devices shows those that do; is it plugged in?"};
  }
  if (access(file.c_str(), R_OK | W_OK) != 0) {
    return {Verdict::Bad, subject, fmt::format("{} may not be read and written by this user", path),
            "add the user to the groups video and gpio, or run it as the service, which is in both"};
  }
  return {Verdict::Good, subject, path, ""};
}

}  // namespace

Machine this_machine() {
  Machine machine;
  machine.is_root = geteuid() == 0;
  rlimit limit{};
  if (getrlimit(RLIMIT_MEMLOCK, &limit) == 0) {
    machine.locked_memory_limit = limit.rlim_cur == RLIM_INFINITY ? kUnlimited : limit.rlim_cur;
  }
  if (getrlimit(RLIMIT_RTPRIO, &limit) == 0) {
    machine.real_time_priority_limit = limit.rlim_cur;
  }
  read_unit_limits(machine);
  return machine;
}

std::vector<Finding> examine_limits(const Machine& machine, const Config& config) {
  std::vector<Finding> findings;
  if (!config.pipeline.lock_memory) {
    findings.push_back(
        {Verdict::Advice, "locked memory", "not asked for: page faults may delay poses", "set pipeline.lock_memory = true"});
  } else if (machine.locked_memory_limit != kUnlimited) {
    findings.push_back({Verdict::Bad, "locked memory", fmt::format("the limit is {} KiB", machine.locked_memory_limit / 1024),
                        "run it as the service, or raise the limit: ulimit -l unlimited, memlock in /etc/security/limits.d"});
  } else {
    findings.push_back({Verdict::Good, "locked memory", "allowed", ""});
  }
  const int wanted = highest_priority(config);
  if (wanted == 0) {
    findings.push_back({Verdict::Advice, "real-time priority", "no thread asks for it: other programs may delay poses",
                        "set policy = \"fifo\" for pipeline.capture and pipeline.tracker"});
  } else if (!machine.is_root && machine.real_time_priority_limit < static_cast<std::uint64_t>(wanted)) {
    findings.push_back({Verdict::Bad, "real-time priority",
                        fmt::format("{} is asked for, {} is the limit", wanted, machine.real_time_priority_limit),
                        "run it as the service, or raise the limit: rtprio in /etc/security/limits.d"});
  } else {
    findings.push_back({Verdict::Good, "real-time priority", fmt::format("up to {}", wanted), ""});
  }
  return findings;
}

std::vector<Finding> examine_kernel(const Machine& machine) {
  std::vector<Finding> findings;
  constexpr std::array<std::string_view, 3> kQuickClocks = {"tsc", "arch_sys_counter", "kvm-clock"};
  if (const auto clock = line_of(machine, "sys/devices/system/clocksource/clocksource0/current_clocksource")) {
    const bool quick = std::find(kQuickClocks.begin(), kQuickClocks.end(), *clock) != kQuickClocks.end();
    findings.push_back({quick ? Verdict::Good : Verdict::Advice, "clock source", *clock,
                        quick ? "" : "reading it costs a system call; see the kernel's parameters clocksource= and tsc="});
  }
  if (const auto governor = line_of(machine, "sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")) {
    const bool steady = *governor == "performance" || *governor == "schedutil";
    findings.push_back({steady ? Verdict::Good : Verdict::Advice, "processor frequency", *governor,
                        steady ? "" : "cpupower frequency-set -g performance"});
  }
  const bool preemptible = line_of(machine, "sys/kernel/realtime").value_or("0") == "1";
  findings.push_back(
      {preemptible ? Verdict::Good : Verdict::Advice, "kernel", preemptible ? "PREEMPT_RT" : "not a real-time kernel",
       preemptible ? "" : "fine for 30 Hz; for bounded latency under load: apt install linux-image-rt-amd64 (or -arm64)"});
  return findings;
}

std::vector<Finding> examine_network(const Machine& machine, const Config& config) {
  if (!config.publisher.url.starts_with("udpm://")) {
    return {{Verdict::Good, "network", config.publisher.url, ""}};
  }
  std::vector<Finding> findings;
  std::ifstream routes(machine.root / "proc/net/route");
  std::string line;
  bool found = false;
  while (std::getline(routes, line)) {
    found = found || leads_to_multicast(line);
  }
  findings.push_back(found ? Finding{Verdict::Good, "multicast route", "there is one", ""}
                           : Finding{Verdict::Bad, "multicast route", "there is none, so LCM cannot start",
                                     "ip link set lo multicast on; ip route add 224.0.0.0/4 dev lo"});
  constexpr std::uint64_t kRoomy = 2'000'000;
  const std::uint64_t room = number_in(line_of(machine, "proc/sys/net/core/rmem_max").value_or("")).value_or(0);
  findings.push_back({room >= kRoomy ? Verdict::Good : Verdict::Advice, "receive buffers",
                      fmt::format("net.core.rmem_max = {}", room),
                      room >= kRoomy ? "" : "subscribers may lose messages: sysctl net.core.rmem_max=4194304"});
  return findings;
}

std::vector<Finding> examine_devices(const Machine& machine, const Config& config) {
  std::vector<Finding> findings;
  const SourceConfig& source = config.source;
  if (source.kind == SourceKind::Synthetic) {
    findings.push_back({Verdict::Advice, "camera", "none: the world is rendered", "posectl devices --config"});
  }
  if (source.kind == SourceKind::V4l2) {
    findings.push_back(device_finding(machine, "camera", source.v4l2.device));
  }
  if (source.kind == SourceKind::V4l2 || source.kind == SourceKind::Libcamera) {
    findings.push_back(device_finding(machine, "depth camera", source.depth.node.device));
  }
  if (!config.gpio.chip.empty()) {
    const std::string& chip = config.gpio.chip;
    findings.push_back(device_finding(machine, "GPIO chip", chip.starts_with('/') ? chip : "/dev/" + chip));
  }
  return findings;
}

std::vector<Finding> examine_calibration(const Config& config) {
  const CameraIntrinsics& k = config.intrinsics;
  const std::string file = std::filesystem::path(config.camera.calibration).filename().string();
  std::vector<Finding> findings;
  const bool centred = std::abs(k.cx / k.width - 0.5) < 0.15 && std::abs(k.cy / k.height - 0.5) < 0.15;
  const bool plausible = k.fx > 0.3 * k.width && k.fx < 5.0 * k.width && std::abs(k.fx / k.fy - 1) < 0.1;
  if (!centred || !plausible) {
    findings.push_back({Verdict::Bad, "calibration",
                        fmt::format("{}: fx {:.1f}, fy {:.1f}, cx {:.1f}, cy {:.1f} hardly fit an image of {}x{}", file, k.fx, k.fy,
                                    k.cx, k.cy, k.width, k.height),
                        "posectl calibrate; was the file made for another image size?"});
  } else if (config.source.kind != SourceKind::Synthetic && file == "primesense_default.toml") {
    findings.push_back({Verdict::Advice, "calibration", file + ": what such cameras have on average", "posectl calibrate"});
  } else {
    findings.push_back({Verdict::Good, "calibration", file, ""});
  }
  return findings;
}

}  // namespace posed
