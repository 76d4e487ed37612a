#include "drivers/device_clock.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace posed {
namespace {

/// A device whose clock begins at any time and runs slow by `skew`, and whose frames arrive late by an exponential delay.
class Device {
 public:
  Device(double skew, TimeNs start_ns, TimeNs mean_delay_ns, unsigned seed)
      : skew_(skew), start_ns_(start_ns), delay_ns_(1.0 / static_cast<double>(mean_delay_ns)), random_(seed) {}

  TimeNs stamp_ns(TimeNs true_ns) const {
    return start_ns_ + static_cast<TimeNs>(std::llround(static_cast<double>(true_ns) / (1.0 + skew_)));
  }
  TimeNs arrival_ns(TimeNs true_ns) { return true_ns + static_cast<TimeNs>(delay_ns_(random_)); }

 private:
  double skew_;
  TimeNs start_ns_;
  std::exponential_distribution<double> delay_ns_;
  std::mt19937 random_;
};

constexpr TimeNs kPeriod_ns = 33'333'333;

TEST(DeviceClock, FollowsOffsetAndSkewThroughJitter) {
  for (const double skew : {-200e-6, 0.0, 50e-6, 200e-6}) {
    Device device(skew, -5'000'000'000'000, 4 * kNsPerMs, 7);
    DeviceClock clock;
    std::vector<TimeNs> errors_ns;
    for (TimeNs true_ns = kNsPerSecond; true_ns < 300 * kNsPerSecond; true_ns += kPeriod_ns) {
      const TimeNs arrival_ns = device.arrival_ns(true_ns);
      const TimeNs mapped_ns = clock.to_monotonic(device.stamp_ns(true_ns), arrival_ns);
      EXPECT_LE(mapped_ns, arrival_ns);
      if (true_ns > 30 * kNsPerSecond) {
        errors_ns.push_back(std::abs(mapped_ns - true_ns));
      }
    }
    std::sort(errors_ns.begin(), errors_ns.end());
    EXPECT_LT(errors_ns[errors_ns.size() / 2], 150 * kNsPerUs) << skew;  // frames themselves arrive 4 ms late in the mean
    EXPECT_LT(errors_ns.back(), 500 * kNsPerUs) << skew;
    EXPECT_NEAR(clock.quality().skew_ppm, skew * 1e6, 10) << skew;
    EXPECT_LT(clock.quality().error_ns, 500 * kNsPerUs);
    EXPECT_EQ(clock.quality().resets, 0U);
  }
}

TEST(DeviceClock, TheFirstFrameWasTakenWhenItArrived) {
  DeviceClock clock;
  EXPECT_EQ(clock.to_monotonic(123, 5000), 5000);
}

TEST(DeviceClock, AnEarlierArrivalCorrectsTheOffsetAtOnce) {
  DeviceClock clock;
  EXPECT_EQ(clock.to_monotonic(0, 20 * kNsPerMs), 20 * kNsPerMs);
  EXPECT_EQ(clock.to_monotonic(kPeriod_ns, kPeriod_ns + 5 * kNsPerMs), kPeriod_ns + 5 * kNsPerMs);
  EXPECT_EQ(clock.to_monotonic(2 * kPeriod_ns, 2 * kPeriod_ns + 20 * kNsPerMs), 2 * kPeriod_ns + 5 * kNsPerMs);
}

TEST(DeviceClock, BeginsAnewWhereTheDevicesClockIsSet) {
  DeviceClock clock;
  TimeNs now_ns = 100 * kNsPerSecond;
  const auto feed = [&](TimeNs stamp_ns) {
    now_ns += kPeriod_ns;
    return clock.to_monotonic(stamp_ns, now_ns);
  };
  TimeNs stamp_ns = 50 * kNsPerSecond;
  for (int i = 0; i < 300; ++i) {
    EXPECT_EQ(feed(stamp_ns += kPeriod_ns), now_ns);
  }
  stamp_ns = 0;  // back
  EXPECT_EQ(feed(stamp_ns), now_ns);
  EXPECT_EQ(clock.quality().resets, 1U);
  EXPECT_EQ(feed(stamp_ns += kPeriod_ns), now_ns);
  stamp_ns += 3600 * kNsPerSecond;  // ahead: the frame seems to arrive before it was taken
  EXPECT_EQ(feed(stamp_ns), now_ns);
  EXPECT_EQ(clock.quality().resets, 2U);
  now_ns += 10 * kNsPerSecond;  // the device slept and its clock with it
  EXPECT_EQ(feed(stamp_ns += kPeriod_ns), now_ns);
  EXPECT_EQ(clock.quality().resets, 3U);
}

TEST(DeviceClock, ALateFrameMovesNothing) {
  DeviceClock clock;
  TimeNs true_ns = 0;
  for (int i = 0; i < 900; ++i) {
    true_ns += kPeriod_ns;
    const TimeNs late_ns = i % 100 == 99 ? kNsPerSecond : 0;
    EXPECT_NEAR(static_cast<double>(clock.to_monotonic(true_ns, true_ns + late_ns)), static_cast<double>(true_ns), 2.0) << i;
  }
  EXPECT_EQ(clock.quality().resets, 0U);
}

TEST(DeviceClock, GoesOnWhereTheDevicesCounterWrapsAround) {
  DeviceClock clock;
  constexpr TimeNs kLast_ns = std::numeric_limits<TimeNs>::max();
  EXPECT_EQ(clock.to_monotonic(kLast_ns - 10, 1000), 1000);
  EXPECT_EQ(clock.to_monotonic(std::numeric_limits<TimeNs>::min() + 9, 1020), 1020);
  EXPECT_EQ(clock.quality().resets, 0U);
}

TEST(DeviceClock, BeginsAnewAfterAnyLeap) {
  constexpr TimeNs kFirst_ns = std::numeric_limits<TimeNs>::min();
  constexpr TimeNs kLast_ns = std::numeric_limits<TimeNs>::max();
  for (const TimeNs from_ns : {kFirst_ns, kFirst_ns / 2, TimeNs{0}, kLast_ns / 2, kLast_ns}) {
    for (const TimeNs to_ns : {kFirst_ns, kFirst_ns / 2, TimeNs{0}, kLast_ns / 2, kLast_ns}) {
      if (static_cast<std::uint64_t>(to_ns) - static_cast<std::uint64_t>(from_ns) + 2 <= 4) {
        continue;  // a step, by the counter's wrap
      }
      DeviceClock clock;
      clock.to_monotonic(from_ns, kNsPerSecond);
      EXPECT_EQ(clock.to_monotonic(to_ns, 2 * kNsPerSecond), 2 * kNsPerSecond) << from_ns << " to " << to_ns;
      EXPECT_EQ(clock.quality().resets, 1U) << from_ns << " to " << to_ns;
    }
  }
}

TEST(DeviceClock, ForgetsWhatItKnewAtARestart) {
  DeviceClock clock;
  clock.to_monotonic(10 * kNsPerSecond, 10 * kNsPerSecond);
  clock.restart();
  EXPECT_EQ(clock.to_monotonic(0, 30 * kNsPerSecond), 30 * kNsPerSecond);
  EXPECT_EQ(clock.quality().resets, 0U);
}

}  // namespace
}  // namespace posed
