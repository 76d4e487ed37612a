#include "drivers/frame_pairer.h"

#include <algorithm>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace posed {
namespace {

constexpr TimeNs kMs = kNsPerMs;

std::vector<std::uint32_t> buffers_of(const FramePairer::Outcome& outcome, PairSide side) {
  std::vector<std::uint32_t> buffers;
  for (const FramePairer::Discarded& discarded : outcome.discarded()) {
    if (discarded.side == side) {
      buffers.push_back(discarded.image.buffer);
    }
  }
  return buffers;
}

TEST(FramePairer, TheNearestWithinTheLimitIsTaken) {
  FramePairer pairer({.capacity = {4, 4}});
  EXPECT_FALSE(pairer.add(PairSide::Color, {100 * kMs, 1, 1}).paired);
  EXPECT_FALSE(pairer.add(PairSide::Color, {133 * kMs, 2, 2}).paired);
  EXPECT_FALSE(pairer.add(PairSide::Color, {166 * kMs, 3, 3}).paired);
  const FramePairer::Outcome outcome = pairer.add(PairSide::Depth, {140 * kMs, 9, 7});
  ASSERT_TRUE(outcome.paired);
  EXPECT_EQ(outcome.color.buffer, 2U);
  EXPECT_EQ(outcome.depth.buffer, 7U);
  EXPECT_THAT(buffers_of(outcome, PairSide::Color), testing::ElementsAre(1));
  EXPECT_THAT(buffers_of(outcome, PairSide::Depth), testing::IsEmpty());
  // The third still waits.
  EXPECT_EQ(pairer.add(PairSide::Depth, {170 * kMs, 10, 8}).color.buffer, 3U);
}

TEST(FramePairer, TheLimitItselfIsAllowedAndNoMore) {
  FramePairer pairer({.max_difference_ns = 10 * kMs});
  pairer.add(PairSide::Color, {100 * kMs, 0, 0});
  EXPECT_FALSE(pairer.add(PairSide::Depth, {110 * kMs + 1, 0, 0}).paired);
  FramePairer second({.max_difference_ns = 10 * kMs});
  second.add(PairSide::Color, {100 * kMs, 0, 0});
  EXPECT_TRUE(second.add(PairSide::Depth, {110 * kMs, 0, 0}).paired);
}

TEST(FramePairer, TheOldestIsLetGoWhereTooManyWait) {
  FramePairer pairer({.capacity = {2, 2}});
  for (std::uint32_t i = 0; i < 10; ++i) {
    const FramePairer::Outcome outcome = pairer.add(PairSide::Depth, {(100 + 33 * i) * kMs, i, i});
    const auto expected = i < 2 ? std::vector<std::uint32_t>{} : std::vector<std::uint32_t>{i - 2};
    EXPECT_EQ(buffers_of(outcome, PairSide::Depth), expected);
  }
}

TEST(FramePairer, ABadBeginningDoesNotLast) {
  // Depth follows colour by 5 ms. The first depth image is 28 ms before the first colour image, within a generous limit; taking it
  // would pair each colour image with the depth image before it for ever.
  FramePairer pairer({.max_difference_ns = 32 * kMs, .period_ns = {33 * kMs, 33 * kMs}});
  EXPECT_FALSE(pairer.add(PairSide::Depth, {105 * kMs, 0, 0}).paired);
  for (std::uint32_t i = 1; i < 10; ++i) {
    EXPECT_FALSE(pairer.add(PairSide::Color, {(100 + 33 * i) * kMs, i, i}).paired);
    const FramePairer::Outcome outcome = pairer.add(PairSide::Depth, {(105 + 33 * i) * kMs, i, i});
    ASSERT_TRUE(outcome.paired);
    EXPECT_EQ(outcome.color.sequence, outcome.depth.sequence);
  }
}

TEST(FramePairer, ASideThatGoesBackBeginsAnew) {
  FramePairer pairer({.capacity = {4, 4}});
  pairer.add(PairSide::Color, {500 * kMs, 0, 0});
  pairer.add(PairSide::Color, {533 * kMs, 1, 1});
  const FramePairer::Outcome outcome = pairer.add(PairSide::Color, {100 * kMs, 2, 2});
  EXPECT_THAT(buffers_of(outcome, PairSide::Color), testing::ElementsAre(0, 1));
  EXPECT_TRUE(pairer.add(PairSide::Depth, {101 * kMs, 0, 0}).paired);
}

struct Arrival {
  TimeNs at_ns;
  PairSide side;
  UnpairedImage image;
  std::uint32_t moment;
};

/// 30 Hz of both, each image with its own jitter, delay and fate.
std::vector<Arrival> arrivals(std::uint32_t seed, double drop, TimeNs depth_lag_ns) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> jitter(-4e6, 4e6);
  std::uniform_real_distribution<double> delay(0, 10e6);
  std::bernoulli_distribution dropped(drop);
  std::vector<Arrival> all;
  std::uint32_t buffer = 0;
  for (std::uint32_t moment = 0; moment < 3000; ++moment) {
    for (const PairSide side : {PairSide::Color, PairSide::Depth}) {
      const TimeNs stamp_ns = kNsPerSecond + moment * TimeNs{33'333'333} + static_cast<TimeNs>(jitter(random));
      const TimeNs lag_ns = side == PairSide::Depth ? depth_lag_ns : 0;
      if (!dropped(random)) {
        all.push_back({stamp_ns + lag_ns + static_cast<TimeNs>(delay(random)), side, {stamp_ns, moment, buffer++}, moment});
      }
    }
  }
  std::sort(all.begin(), all.end(), [](const Arrival& a, const Arrival& b) { return a.at_ns < b.at_ns; });
  return all;
}

class JitterAndDrops : public testing::TestWithParam<TimeNs> {};

TEST_P(JitterAndDrops, EveryMomentWithBothImagesIsPairedAndEachImageLeavesOnce) {
  for (const double drop : {0.0, 0.1, 0.5}) {
    const std::vector<Arrival> all = arrivals(7, drop, GetParam());
    FramePairer pairer({.capacity = {4, 4}});
    std::vector<int> left(all.size(), 0);
    std::vector<int> seen(3000, 0);
    for (const Arrival& arrival : all) {
      ++seen[arrival.moment];
    }
    std::size_t pairs = 0;
    TimeNs last_ns = 0;
    for (const Arrival& arrival : all) {
      const FramePairer::Outcome outcome = pairer.add(arrival.side, arrival.image);
      for (const FramePairer::Discarded& discarded : outcome.discarded()) {
        ++left[discarded.image.buffer];
      }
      if (outcome.paired) {
        ++pairs;
        ++left[outcome.color.buffer];
        ++left[outcome.depth.buffer];
        ASSERT_EQ(outcome.color.sequence, outcome.depth.sequence) << "of one moment";
        ASSERT_GT(outcome.color.capture_ns, last_ns);
        last_ns = outcome.color.capture_ns;
      }
    }
    EXPECT_EQ(pairs, static_cast<std::size_t>(std::count(seen.begin(), seen.end(), 2))) << "drop " << drop;
    EXPECT_EQ(std::count_if(left.begin(), left.end(), [](int times) { return times > 1; }), 0);
    EXPECT_LE(std::count(left.begin(), left.end(), 0), 8) << "only what still waits at the end";
  }
}

INSTANTIATE_TEST_SUITE_P(DepthLags, JitterAndDrops, testing::Values(0, 20 * kMs, 70 * kMs));

}  // namespace
}  // namespace posed
