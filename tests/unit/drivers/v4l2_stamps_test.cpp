#include "drivers/v4l2/v4l2_stamps.h"

#include <cstdint>
#include <limits>

#include <gtest/gtest.h>

namespace posed {
namespace {

v4l2_buffer stamped(TimeNs stamp_ns, std::uint32_t flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC) {
  v4l2_buffer buffer{};
  buffer.flags = flags;
  buffer.timestamp.tv_sec = stamp_ns / kNsPerSecond;
  buffer.timestamp.tv_usec = stamp_ns % kNsPerSecond / kNsPerUs;
  return buffer;
}

constexpr TimeNs kSecond = kNsPerSecond;

TEST(V4l2Stamps, TheSameStampTwiceIsBad) {
  V4l2Stamps stamps;
  EXPECT_EQ(stamps.time_of(stamped(5 * kSecond), 6 * kSecond).value(), 5 * kSecond);
  const Result<TimeNs> again = stamps.time_of(stamped(5 * kSecond), 6 * kSecond + 1);
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::BadData);
  EXPECT_EQ(stamps.time_of(stamped(5 * kSecond + kNsPerMs), 7 * kSecond).value(), 5 * kSecond + kNsPerMs);
  EXPECT_EQ(stamps.resets(), 0U);
  EXPECT_EQ(stamps.error_ns(), 0);
}

TEST(V4l2Stamps, OldOnesAreTrueAndFutureOnesAreNot) {
  V4l2Stamps stamps;
  EXPECT_EQ(stamps.time_of(stamped(5 * kSecond), 60 * kSecond).value(), 5 * kSecond);
  EXPECT_EQ(stamps.time_of(stamped(61 * kSecond + 4 * kNsPerMs), 61 * kSecond).value(), 61 * kSecond + 4 * kNsPerMs);
  EXPECT_EQ(stamps.time_of(stamped(63 * kSecond), 62 * kSecond).value(), 62 * kSecond) << "on its own clock from now on";
  EXPECT_EQ(stamps.time_of(stamped(64 * kSecond), 63 * kSecond + kNsPerMs).value(), 63 * kSecond);
  EXPECT_EQ(stamps.resets(), 1U);
  stamps.restart();
  EXPECT_EQ(stamps.time_of(stamped(66 * kSecond), 64 * kSecond).value(), 64 * kSecond);
  EXPECT_EQ(stamps.resets(), 1U) << "a claim that was wrong from the start is no leap";
  stamps.restart();
  EXPECT_EQ(stamps.time_of(stamped(64 * kSecond), 65 * kSecond).value(), 64 * kSecond) << "believed again";
}

TEST(V4l2Stamps, ThoseFarOutsideOfAnyTimeAreADevicesOwn) {
  V4l2Stamps stamps;
  v4l2_buffer buffer = stamped(0);
  TimeNs arrival_ns = 60 * kSecond;
  for (const std::int64_t seconds : {std::int64_t{-7'000'000'000'000}, std::int64_t{-9'000'000'000}, std::int64_t{9'000'000'000},
                                     std::numeric_limits<std::int64_t>::max(), std::int64_t{1}}) {
    buffer.timestamp.tv_sec = seconds;
    buffer.timestamp.tv_usec = 1;
    arrival_ns += kSecond;
    EXPECT_EQ(stamps.time_of(buffer, arrival_ns).value(), arrival_ns) << seconds;
  }
}

TEST(V4l2Stamps, WithoutAStampTheTimeOfArrivalCounts) {
  V4l2Stamps stamps;
  for (const TimeNs arrival_ns : {5 * kSecond, 6 * kSecond}) {
    EXPECT_EQ(stamps.time_of(stamped(0, V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN), arrival_ns).value(), arrival_ns);
  }
  EXPECT_EQ(stamps.resets(), 0U);
}

}  // namespace
}  // namespace posed
