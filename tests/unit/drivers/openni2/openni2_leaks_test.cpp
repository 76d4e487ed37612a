#include <filesystem>
#include <fstream>
#include <string>

#include "tests/unit/drivers/openni2/openni2_rig.h"

namespace posed::test {
namespace {

constexpr int kWarmUp = 3;
constexpr int kCycles = 20;

/// What the process holds of the system.
struct Holdings {
  std::ptrdiff_t descriptors = 0;
  std::ptrdiff_t threads = 0;
  std::ptrdiff_t mappings = 0;
};

Holdings holdings() {
  const auto count = [](const char* folder) {
    return std::distance(std::filesystem::directory_iterator(folder), std::filesystem::directory_iterator());
  };
  std::ifstream maps("/proc/self/maps");
  std::ptrdiff_t lines = 0;
  for (std::string line; std::getline(maps, line);) {
    ++lines;
  }
  return {count("/proc/self/fd"), count("/proc/self/task"), lines};
}

class OpenNi2LeaksTest : public OpenNi2Test {
 protected:
  OpenNi2LeaksTest() { fake_openni2().plug(fake_camera()); }
};

void expect_no_growth(const Holdings& before, const Holdings& after) {
  EXPECT_EQ(after.descriptors, before.descriptors);
  EXPECT_EQ(after.threads, before.threads);
  EXPECT_LE(after.mappings, before.mappings + kCycles / 2) << "the allocator may add some, not one a cycle";
}

TEST_F(OpenNi2LeaksTest, ACameraThatIsOpenedAgainAndAgainKeepsNothing) {
  Running running(openni2_config(), SystemClock::instance());
  Holdings before;
  std::uint64_t stamp_us = 1'000'000;
  for (int cycle = 0; cycle < kWarmUp + kCycles; ++cycle) {
    while (running.open().kind != CaptureKind::Stopped) {
    }
    push_pair(stamp_us += 33'333, cycle + 1);
    ASSERT_EQ(running.next().kind, CaptureKind::Frame);
    if (cycle == kWarmUp) {
      before = holdings();
    }
    if (cycle == kWarmUp + kCycles - 1) {
      expect_no_growth(before, holdings());
    }
    fake_openni2().unplug("fake/0");
    ASSERT_EQ(running.next().kind, CaptureKind::Interrupted);
    fake_openni2().plug(fake_camera());
  }
}

TEST_F(OpenNi2LeaksTest, ASourceThatIsMadeAgainAndAgainKeepsNothing) {
  Holdings before;
  for (int cycle = 0; cycle < kWarmUp + kCycles; ++cycle) {
    if (cycle == kWarmUp) {
      before = holdings();
    }
    Running running(openni2_config(), SystemClock::instance());
    running.open();
    push_pair(1'000'000, 1);
    ASSERT_EQ(running.next().kind, CaptureKind::Frame);
  }
  expect_no_growth(before, holdings());
  EXPECT_EQ(fake_openni2().state("fake/0").times_opened, fake_openni2().state("fake/0").times_closed);
}

}  // namespace
}  // namespace posed::test
