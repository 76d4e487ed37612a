#include "drivers/libcamera/sensor_stamps.h"

#include <gtest/gtest.h>

namespace posed {
namespace {

constexpr TimeNs kNow_ns = 500 * kNsPerSecond;

TEST(SensorStamps, MonotonicOnesAreUsedAsTheyAre) {
  SensorStamps stamps;
  for (int i = 0; i < 100; ++i) {
    const TimeNs stamp_ns = kNow_ns + i * 33 * kNsPerMs;
    EXPECT_EQ(stamps.time_of(stamp_ns, stamp_ns + (i % 7) * 10 * kNsPerMs), stamp_ns);
  }
  EXPECT_EQ(stamps.resets(), 0U);
  EXPECT_EQ(stamps.error_ns(), 0);
}

TEST(SensorStamps, WithoutAStampTheArrivalCounts) {
  SensorStamps stamps;
  EXPECT_EQ(stamps.time_of(0, kNow_ns), kNow_ns);
  EXPECT_EQ(stamps.resets(), 0U);
}

TEST(SensorStamps, ThoseOfAnotherClockAreMapped) {
  for (const TimeNs offset_ns : {-400 * kNsPerSecond, 10 * kNsPerMs, 1'000'000 * kNsPerSecond}) {
    SensorStamps stamps;
    for (int i = 0; i < 200; ++i) {
      const TimeNs taken_ns = kNow_ns + i * 33 * kNsPerMs;
      const TimeNs arrival_ns = taken_ns + 4 * kNsPerMs + (i % 5) * kNsPerMs;
      const TimeNs time_ns = stamps.time_of(taken_ns + offset_ns, arrival_ns);
      EXPECT_LE(time_ns, arrival_ns);
      if (i > 60) {
        EXPECT_NEAR(static_cast<double>(time_ns), static_cast<double>(taken_ns + 4 * kNsPerMs), 1e6)
            << "the least delay stays in it";
      }
    }
    EXPECT_EQ(stamps.resets(), 0U) << offset_ns;
  }
}

TEST(SensorStamps, ACameraThatIsOpenedAgainIsBelievedAgain) {
  SensorStamps stamps;
  stamps.time_of(kNow_ns, kNow_ns);
  stamps.time_of(2 * kNow_ns, kNow_ns + kNsPerMs);
  EXPECT_EQ(stamps.resets(), 1U) << "its stamps had been true";
  stamps.time_of(kNow_ns, kNow_ns + 2 * kNsPerMs);
  EXPECT_EQ(stamps.resets(), 2U) << "its clock was set";
  stamps.restart();
  EXPECT_EQ(stamps.time_of(kNow_ns - kNsPerMs, kNow_ns), kNow_ns - kNsPerMs);
  EXPECT_EQ(stamps.resets(), 2U) << "counts only grow";
}

}  // namespace
}  // namespace posed
