#include "drivers/tum_sequence.h"

#include <algorithm>
#include <random>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/test_recording.h"

namespace posed {
namespace {

using testing::HasSubstr;

using StampPair = std::pair<std::int64_t, std::int64_t>;

std::vector<TumListEntry> entries(const std::set<std::int64_t>& stamps) {
  std::vector<TumListEntry> result;
  for (const std::int64_t stamp : stamps) {
    result.push_back({stamp, std::to_string(stamp), 1});
  }
  return result;
}

std::vector<StampPair> stamp_pairs(const std::vector<TumAssociation>& pairs) {
  std::vector<StampPair> result;
  for (const TumAssociation& pair : pairs) {
    result.emplace_back(pair.color.stamp_ns, pair.depth.stamp_ns);
  }
  return result;
}

/// The definition, taken literally.
std::vector<StampPair> pair_by_definition(const std::set<std::int64_t>& color, const std::set<std::int64_t>& depth,
                                          std::int64_t max_difference) {
  std::vector<StampPair> pairs;
  for (const std::int64_t c : color) {
    const auto nearest = std::min_element(depth.begin(), depth.end(),
                                          [c](std::int64_t a, std::int64_t b) { return std::abs(a - c) < std::abs(b - c); });
    if (nearest != depth.end() && std::abs(*nearest - c) <= max_difference) {
      pairs.emplace_back(c, *nearest);
    }
  }
  return pairs;
}

TEST(PairByStamp, EqualsItsDefinitionOnRandomLists) {
  std::mt19937 random(7);
  std::size_t made = 0;
  for (int round = 0; round < 3000; ++round) {
    // Small ranges, so that ties and equal stamps are common.
    std::uniform_int_distribution<std::int64_t> stamp(0, 10 + round % 90);
    std::uniform_int_distribution<int> count(0, 25);
    std::set<std::int64_t> color;
    std::set<std::int64_t> depth;
    for (int n = count(random); n > 0; --n) {
      color.insert(stamp(random));
    }
    for (int n = count(random); n > 0; --n) {
      depth.insert(stamp(random));
    }
    const std::int64_t max_difference = round % 12;
    const auto pairs = stamp_pairs(pair_by_stamp(entries(color), entries(depth), max_difference));
    ASSERT_EQ(pairs, pair_by_definition(color, depth, max_difference)) << "round " << round;
    made += pairs.size();
  }
  EXPECT_GT(made, 3000U);
}

TEST(PairByStamp, TheNearestWins) {
  EXPECT_EQ(stamp_pairs(pair_by_stamp(entries({0, 10}), entries({9, 12}), 20)), (std::vector<StampPair>{{0, 9}, {10, 9}}));
  EXPECT_EQ(stamp_pairs(pair_by_stamp(entries({1}), entries({0, 2}), 20)), (std::vector<StampPair>{{1, 0}})) << "a tie";
  EXPECT_EQ(stamp_pairs(pair_by_stamp(entries({0}), entries({20}), 20)).size(), 1U) << "the limit is included";
  EXPECT_TRUE(pair_by_stamp(entries({0}), entries({21}), 20).empty());
  EXPECT_TRUE(pair_by_stamp({}, {}, 20).empty());
  EXPECT_TRUE(pair_by_stamp(entries({0}), {}, 20).empty());
}

class SequenceFolder : public testing::Test {
 protected:
  void lists(std::string_view color, std::string_view depth) {
    write_text(folder_.path() / "rgb.txt", color);
    write_text(folder_.path() / "depth.txt", depth);
  }
  Result<TumSequence> load() { return load_tum_sequence(config_); }
  std::string error() {
    const Result<TumSequence> sequence = load();
    return sequence ? "no error" : sequence.error().message;
  }

  TemporaryFolder folder_;
  ReplayConfig config_{.sequence = folder_.path().string(), .associations = ""};
};

TEST_F(SequenceFolder, MissingPartsAreNamed) {
  EXPECT_THAT(error(), HasSubstr((folder_.path() / "rgb.txt").string()));
  EXPECT_EQ(load().error().code, ErrorCode::NotFound);
  write_text(folder_.path() / "rgb.txt", "1 a\n");
  EXPECT_THAT(error(), HasSubstr((folder_.path() / "depth.txt").string()));
  config_.sequence = (folder_.path() / "none").string();
  EXPECT_THAT(error(), HasSubstr("none' is not a folder"));
  EXPECT_EQ(load().error().code, ErrorCode::NotFound);
}

TEST_F(SequenceFolder, EmptyListsAreErrors) {
  lists("# nothing\n", "1 d\n");
  EXPECT_THAT(error(), HasSubstr("rgb.txt: the list names no image"));
  lists("1 a\n", "");
  EXPECT_THAT(error(), HasSubstr("depth.txt: the list names no image"));
  EXPECT_EQ(load().error().code, ErrorCode::BadData);
}

TEST_F(SequenceFolder, ListsThatNeverMeetAreAnError) {
  lists("1 a\n2 b\n", "1305031102.5 d\n");
  EXPECT_THAT(error(), HasSubstr("lies within 0.02 s"));
  EXPECT_THAT(error(), HasSubstr("1305031102.500000000"));
}

TEST_F(SequenceFolder, PairsWithinTheConfiguredDifference) {
  lists("1.00 a\r\n1.03 b\r\n1.06 c\r\n", "1.01 d\r\n1.031 e\r\n1.2 f\r\n");
  Result<TumSequence> sequence = load();
  ASSERT_TRUE(sequence) << sequence.error().message;
  ASSERT_EQ(sequence->pairs.size(), 2U);
  EXPECT_EQ(sequence->pairs[0].color.image, "a");
  EXPECT_EQ(sequence->pairs[0].depth.image, "d");
  EXPECT_EQ(sequence->pairs[1].depth.image, "e");
  EXPECT_EQ(sequence->unpaired, 1U);
  config_.max_stamp_difference_s = 0.005;
  sequence = load();
  ASSERT_TRUE(sequence);
  EXPECT_EQ(sequence->pairs.size(), 1U);
  EXPECT_EQ(sequence->period_ns, kNsPerSecond / 30) << "one frame has no interval";
}

TEST_F(SequenceFolder, WhatIsOddIsKeptForTheUser) {
  lists("2 b\n1 a\nbad\n1 c\n", "1 d\n2 e\n2 f\n");
  const Result<TumSequence> sequence = load();
  ASSERT_TRUE(sequence);
  EXPECT_EQ(sequence->pairs.size(), 2U);
  EXPECT_EQ(sequence->skipped_lines.size(), 3U);
  ASSERT_EQ(sequence->warnings.size(), 1U);
  EXPECT_THAT(sequence->warnings[0], HasSubstr("rgb.txt:2:"));
}

TEST_F(SequenceFolder, AssociationsAreTakenAsTheyStand) {
  config_.associations = "as.txt";
  EXPECT_THAT(error(), HasSubstr((folder_.path() / "as.txt").string()));
  EXPECT_EQ(load().error().code, ErrorCode::NotFound);
  write_text(folder_.path() / "as.txt", "1 rgb/a 5 depth/b\n3 rgb/c 3 depth/d\n9 rgb/e 9 depth/f\n");
  Result<TumSequence> sequence = load();
  ASSERT_TRUE(sequence) << sequence.error().message;
  EXPECT_EQ(sequence->pairs.size(), 3U) << "whatever the difference";
  EXPECT_EQ(sequence->period_ns, 6 * kNsPerSecond);
  EXPECT_EQ(sequence->color_list, folder_.path() / "as.txt");
  config_.associations = (folder_.path() / "as.txt").string();
  EXPECT_TRUE(load()) << "an absolute name";
}

}  // namespace
}  // namespace posed
