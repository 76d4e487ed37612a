#include "tools/posectl/doctor.h"

#include <algorithm>
#include <cstdint>
#include <limits>

#include <gtest/gtest.h>

#include "config/config_loader.h"
#include "tests/support/temporary_folder.h"

namespace posed {
namespace {

constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

/// The finding of that subject; a test fails where there is none.
Finding of(const std::vector<Finding>& findings, const std::string& subject) {
  const auto found = std::find_if(findings.begin(), findings.end(), [&](const Finding& f) { return f.subject == subject; });
  EXPECT_NE(found, findings.end()) << subject;
  return found == findings.end() ? Finding{} : *found;
}

class DoctorTest : public ::testing::Test {
 protected:
  DoctorTest() { machine_.root = folder_.path(); }

  TemporaryFolder folder_;
  Machine machine_;
  Config config_ = default_config().value();
};

TEST_F(DoctorTest, LimitsAreHeldAgainstWhatIsAskedFor) {
  EXPECT_EQ(of(examine_limits(machine_, config_), "locked memory").verdict, Verdict::Advice) << "not asked for";
  EXPECT_EQ(of(examine_limits(machine_, config_), "real-time priority").verdict, Verdict::Advice);

  config_.pipeline.lock_memory = true;
  config_.pipeline.tracker = {.policy = ThreadPolicyName::Fifo, .priority = 20, .cpus = {}};
  machine_.locked_memory_limit = 8192 * 1024;
  machine_.real_time_priority_limit = 19;
  Finding memory = of(examine_limits(machine_, config_), "locked memory");
  EXPECT_EQ(memory.verdict, Verdict::Bad);
  EXPECT_EQ(memory.found, "the limit is 8192 KiB");
  EXPECT_FALSE(memory.mend.empty());
  EXPECT_EQ(of(examine_limits(machine_, config_), "real-time priority").found, "20 is asked for, 19 is the limit");

  machine_.locked_memory_limit = kUnlimited;
  machine_.real_time_priority_limit = 20;
  EXPECT_EQ(of(examine_limits(machine_, config_), "locked memory").verdict, Verdict::Good);
  EXPECT_EQ(of(examine_limits(machine_, config_), "real-time priority").verdict, Verdict::Good);
}

TEST_F(DoctorTest, TheKernelsClockAndFrequency) {
  folder_.write("sys/devices/system/clocksource/clocksource0/current_clocksource", "hpet\n");
  folder_.write("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "powersave\n");
  std::vector<Finding> findings = examine_kernel(machine_);
  EXPECT_EQ(of(findings, "clock source").verdict, Verdict::Advice);
  EXPECT_EQ(of(findings, "processor frequency").verdict, Verdict::Advice);
  EXPECT_EQ(of(findings, "kernel").verdict, Verdict::Advice);

  folder_.write("sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc\n");
  folder_.write("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance\n");
  folder_.write("sys/kernel/realtime", "1\n");
  findings = examine_kernel(machine_);
  for (const Finding& finding : findings) {
    EXPECT_EQ(finding.verdict, Verdict::Good) << finding.subject;
    EXPECT_TRUE(finding.mend.empty());
  }
  EXPECT_EQ(findings.size(), 3U);
}

TEST_F(DoctorTest, LcmNeedsARouteForMulticast) {
  const std::string head = "Iface\tDestination\tGateway\tFlags\tRefCnt\tUse\tMetric\tMask\tMTU\tWindow\tIRTT\n";
  const std::string local = "eth0\t0002000A\t00000000\t0001\t0\t0\t0\t00FFFFFF\t0\t0\t0\n";
  folder_.write("proc/sys/net/core/rmem_max", "212992\n");
  EXPECT_EQ(of(examine_network(machine_, config_), "multicast route").verdict, Verdict::Bad) << "no table at all";
  folder_.write("proc/net/route", head + local);
  EXPECT_EQ(of(examine_network(machine_, config_), "multicast route").verdict, Verdict::Bad);
  EXPECT_EQ(of(examine_network(machine_, config_), "receive buffers").verdict, Verdict::Advice);

  for (const std::string route : {"lo\t000000E0\t00000000\t0001\t0\t0\t0\t000000F0\t0\t0\t0\n",       // 224.0.0.0/4
                                  "eth0\t00000000\t0100000A\t0003\t0\t0\t0\t00000000\t0\t0\t0\n"}) {  // the default route
    folder_.write("proc/net/route", head + local + route);
    EXPECT_EQ(of(examine_network(machine_, config_), "multicast route").verdict, Verdict::Good) << route;
  }
  folder_.write("proc/net/route", head + "lo\t000000E0\t00000000\t0000\t0\t0\t0\t000000F0\t0\t0\t0\n");
  EXPECT_EQ(of(examine_network(machine_, config_), "multicast route").verdict, Verdict::Bad) << "the interface is down";
  folder_.write("proc/sys/net/core/rmem_max", "4194304\n");
  EXPECT_EQ(of(examine_network(machine_, config_), "receive buffers").verdict, Verdict::Good);

  config_.publisher.url = "memq://";
  EXPECT_EQ(examine_network(machine_, config_).size(), 1U);
}

TEST_F(DoctorTest, DevicesThatTheConfigurationNames) {
  EXPECT_EQ(of(examine_devices(machine_, config_), "camera").verdict, Verdict::Advice) << "the world is rendered";
  config_.source.kind = SourceKind::V4l2;
  config_.source.v4l2.device = "/dev/video0";
  config_.source.depth.node.device = "/dev/video2";
  config_.gpio.chip = "gpiochip0";
  folder_.write("dev/video0", "");
  const std::vector<Finding> findings = examine_devices(machine_, config_);
  EXPECT_EQ(of(findings, "camera").verdict, Verdict::Good);
  EXPECT_EQ(of(findings, "depth camera").verdict, Verdict::Bad);
  EXPECT_EQ(of(findings, "depth camera").found, "/dev/video2 does not exist");
  EXPECT_EQ(of(findings, "GPIO chip").found, "/dev/gpiochip0 does not exist");
}

TEST_F(DoctorTest, CalibrationsThatCannotBeRight) {
  EXPECT_EQ(of(examine_calibration(config_), "calibration").verdict, Verdict::Good);
  Config other = config_;
  other.intrinsics.cx *= 2;  // made for an image of twice the size
  EXPECT_EQ(of(examine_calibration(other), "calibration").verdict, Verdict::Bad);
  other = config_;
  other.intrinsics.fx = 10;
  EXPECT_EQ(of(examine_calibration(other), "calibration").verdict, Verdict::Bad);
  other = config_;
  other.source.kind = SourceKind::OpenNi2;
  other.camera.calibration = "/usr/share/posed/cameras/primesense_default.toml";
  EXPECT_EQ(of(examine_calibration(other), "calibration").verdict, Verdict::Advice);
}

}  // namespace
}  // namespace posed
