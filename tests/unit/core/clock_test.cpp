#include "core/clock.h"

#include <cstdlib>
#include <ctime>
#include <thread>

#include <gtest/gtest.h>

#include "tests/support/manual_clock.h"

namespace posed {
namespace {

TEST(ClockUnits, ConvertBothWays) {
  EXPECT_DOUBLE_EQ(to_ms(1'500'000), 1.5);
  EXPECT_DOUBLE_EQ(to_seconds(1'500'000'000), 1.5);
  EXPECT_EQ(from_seconds(1.5), 1'500'000'000);
  EXPECT_EQ(from_seconds(0.0), 0);
}

TEST(ClockUnits, SecondsRoundToTheNearestNanosecond) {
  // Each product is a hair below the whole number in binary; cutting it off would lose a nanosecond.
  EXPECT_EQ(from_seconds(0.001001001), 1'001'001);
  EXPECT_EQ(from_seconds(-0.001001001), -1'001'001);
  for (TimeNs ns = -5000; ns <= 5000; ++ns) {
    EXPECT_EQ(from_seconds(to_seconds(ns)), ns);
  }
}

TEST(SystemClock, NeverGoesBack) {
  const Clock& clock = SystemClock::instance();
  TimeNs last = clock.now_ns();
  EXPECT_GT(last, 0);
  for (int i = 0; i < 1000; ++i) {
    const TimeNs now = clock.now_ns();
    EXPECT_GE(now, last);
    last = now;
  }
}

TEST(SystemClock, SleepsUntilTheDeadlineAtLeast) {
  const Clock& clock = SystemClock::instance();
  const TimeNs deadline = clock.now_ns() + 2 * kNsPerMs;
  clock.sleep_until(deadline);
  EXPECT_GE(clock.now_ns(), deadline);
}

TEST(SystemClock, DoesNotSleepForADeadlineInThePast) {
  SystemClock::instance().sleep_until(SystemClock::instance().now_ns() - kNsPerSecond);
  SystemClock::instance().sleep_until(-1);  // returning at all is the test: nothing else can wake it
}

TEST(SystemClock, UtcIsTheRealTimeClockAtThatInstant) {
  const Clock& clock = SystemClock::instance();
  const TimeNs now = clock.now_ns();
  const std::int64_t earlier = clock.utc_ns(now - kNsPerSecond);
  const std::int64_t utc = clock.utc_ns(now);
  // A second of tolerance: the machine may be loaded, or its clock be set, between the readings.
  EXPECT_LE(std::abs(utc - static_cast<std::int64_t>(std::time(nullptr)) * kNsPerSecond), 2 * kNsPerSecond);
  EXPECT_LE(std::abs(utc - earlier - kNsPerSecond), kNsPerSecond);
}

TEST(ManualClock, MovesOnlyWhenAdvanced) {
  ManualClock clock(100, 1'000'000);
  EXPECT_EQ(clock.now_ns(), 100);
  clock.advance(50);
  EXPECT_EQ(clock.now_ns(), 150);
  EXPECT_EQ(clock.utc_ns(150), 1'000'150);
  clock.sleep_until(150);  // reached already
}

TEST(ManualClock, ReleasesASleeperOnceItsDeadlineHasCome) {
  ManualClock clock;
  TimeNs woke_at_ns = 0;
  std::thread sleeper([&] {
    clock.sleep_until(10);
    woke_at_ns = clock.now_ns();
  });
  clock.wait_for_sleepers(1);
  clock.advance(9);
  clock.wait_for_sleepers(1);  // still asleep
  clock.advance(1);
  sleeper.join();
  EXPECT_EQ(woke_at_ns, 10);
}

}  // namespace
}  // namespace posed
