#include "detect/person_memory.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace posed {
namespace {

constexpr TimeNs kFrame = 33 * kNsPerMs;
constexpr float kRise = 4.48169F;  // of the odds, for somebody who is surely seen: e^1.5

BoundingBox person_at(float x) {
  return {x, 100, x + 100, 400};
}

/// Frames of 640x480, one after the other.
class Stream {
 public:
  std::vector<Detection> next(const std::vector<Detection>& most_confident_first, TimeNs after_ns = kFrame) {
    Detections found;
    found.stamp_utc_ns = stamp_ns_ += after_ns;
    found.image_width = 640;
    found.image_height = 480;
    found.assign(most_confident_first);
    memory_.judge(found);
    return {found.found().begin(), found.found().end()};
  }

 private:
  PersonMemory memory_{kNsPerSecond};
  TimeNs stamp_ns_ = 1'700'000'000 * kNsPerSecond;
};

float odds(float score) {
  return score / (1 - score);
}

TEST(PersonMemory, BelievesWhoWasSurelySeenMore) {
  Stream stream;
  EXPECT_EQ(stream.next({{person_at(100), 0.8F}}), std::vector<Detection>({{person_at(100), 0.8F}})) << "nobody is known yet";
  EXPECT_NEAR(odds(stream.next({{person_at(104), 0.8F}})[0].score), kRise * odds(0.8F), 0.02F);

  const Detection unsure = stream.next({{person_at(108), 0.2F}})[0];
  EXPECT_GT(odds(unsure.score), 4 * odds(0.2F));
  EXPECT_LT(odds(unsure.score), kRise * odds(0.2F));
}

TEST(PersonMemory, BelievesTheLessTheLongerAgoThatWas) {
  Stream stream;
  stream.next({{person_at(100), 0.8F}});
  float score = 1;
  for (int frame = 0; frame < 60; ++frame) {
    const float before = score;
    score = stream.next({{person_at(100), 0.2F}})[0].score;
    EXPECT_LT(score, before);
    EXPECT_GT(score, 0.2F);
  }
  EXPECT_NEAR(odds(score), std::exp(1.5F * std::exp(-60 * 0.033F)) * odds(0.2F), 0.01F);
}

TEST(PersonMemory, LeavesWhoWasNeverSurelySeen) {
  Stream stream;
  stream.next({{person_at(100), 0.45F}});
  const Detection as_seen{person_at(110), 0.45F};
  EXPECT_EQ(stream.next({as_seen})[0], as_seen);
}

TEST(PersonMemory, CalmsBoxesThatWaver) {
  Stream stream;
  float farthest = 0;
  for (int frame = 0; frame < 40; ++frame) {
    const float x = frame % 2 == 0 ? 95 : 105;
    const std::vector<Detection> found = stream.next({{person_at(x), frame < 20 ? 0.9F : 0.3F}});
    ASSERT_EQ(found.size(), 1U);
    farthest = frame < 10 ? 0 : std::max(farthest, std::abs(found[0].box.x_min - 100));
    EXPECT_FLOAT_EQ(found[0].box.y_min, 100);
  }
  EXPECT_LT(farthest, 4);
  EXPECT_GT(farthest, 0);
}

TEST(PersonMemory, DoesNotLagBehindWhoWalksOn) {
  Stream stream;
  for (int frame = 0; frame < 20; ++frame) {
    const float x = 20 + 15 * static_cast<float>(frame);
    const Detection found = stream.next({{person_at(x), 0.9F}})[0];
    EXPECT_LT(std::abs(found.box.x_min - x), frame < 10 ? 12 : 1) << frame;
  }
}

TEST(PersonMemory, MovesAnUnsureBoxMore) {
  const auto moved_by = [](float score) {
    Stream stream;
    stream.next({{person_at(100), 0.9F}});
    return 110 - stream.next({{person_at(110), score}})[0].box.x_min;
  };
  EXPECT_FLOAT_EQ(moved_by(0.9F), 3);
  EXPECT_FLOAT_EQ(moved_by(0.4F), 5);
}

TEST(PersonMemory, GivesAPersonToOneBox) {
  Stream stream;
  stream.next({{person_at(100), 0.9F}});
  const std::vector<Detection> found = stream.next({{person_at(110), 0.8F}, {person_at(100), 0.3F}, {person_at(125), 0.2F}});
  EXPECT_GT(found[0].score, 0.9F) << "a sure box before an unsure one, even where that overlaps more";
  EXPECT_EQ(found[1].score, 0.3F);
  EXPECT_EQ(found[2].score, 0.2F);
}

TEST(PersonMemory, GivesAPersonToTheSurerOfBoxesInAboutTheSamePlace) {
  Stream stream;
  stream.next({{person_at(100), 0.9F}});
  const std::vector<Detection> found = stream.next({{person_at(104), 0.9F}, {person_at(101), 0.6F}});
  EXPECT_GT(found[0].score, 0.95F);
  EXPECT_EQ(found[1].score, 0.6F);
}

TEST(PersonMemory, KeepsTwoApartWhoPass) {
  Stream stream;
  for (float x = 0; x < 90; x += 10) {
    stream.next({{person_at(100 + x), 0.9F}, {person_at(330 - x), 0.9F}});
  }
  // One goes behind the other: each is taken for who goes on as before.
  const std::vector<Detection> found = stream.next({{person_at(190), 0.9F}, {person_at(240), 0.2F}, {person_at(215), 0.1F}});
  EXPECT_NEAR(found[1].box.x_min, 240, 2);
  EXPECT_GT(odds(found[1].score), 4 * odds(0.2F));
  EXPECT_EQ(found[2].score, 0.1F) << "nobody is left who it could be";
}

TEST(PersonMemory, FollowsWhoGoesFast) {
  Stream stream;
  float x = 20;
  for (int frame = 0; frame < 12; ++frame, x += 20) {
    stream.next({{person_at(x), 0.9F}});
  }
  // Unseen for two frames, 60 pixels on: too far from the last box (overlap 0.25), not from where they should be.
  stream.next({});
  stream.next({});
  EXPECT_GT(stream.next({{person_at(x + 40), 0.2F}})[0].score, 0.4F);
}

TEST(PersonMemory, OrdersBoxesAnew) {
  Stream stream;
  stream.next({{person_at(300), 0.9F}});
  const std::vector<Detection> found = stream.next({{person_at(100), 0.4F}, {person_at(300), 0.3F}});
  EXPECT_EQ(found[0].box, person_at(300));
  EXPECT_EQ(found[1].box, person_at(100));
}

TEST(PersonMemory, ForgetsWhoIsNotSeen) {
  Stream stream;
  stream.next({{person_at(100), 0.9F}});
  for (int frame = 0; frame < 6; ++frame) {
    stream.next({});
  }
  EXPECT_EQ(stream.next({{person_at(100), 0.3F}})[0].score, 0.3F);
}

TEST(PersonMemory, ForgetsEverybodyAcrossAGapAndWhenTimeGoesBack) {
  for (const TimeNs after_ns : {kNsPerSecond, TimeNs{0}, -kFrame}) {
    Stream stream;
    stream.next({{person_at(100), 0.9F}});
    EXPECT_EQ(stream.next({{person_at(100), 0.3F}}, after_ns)[0].score, 0.3F);
  }
}

TEST(PersonMemory, HoldsNoMoreThanAFrameCan) {
  std::vector<Detection> crowd;
  for (std::size_t i = 0; i < Detections::kCapacity; ++i) {
    const auto x = static_cast<float>(9 * i);
    crowd.push_back({{x, 0, x + 5, 9}, 0.9F});
  }
  Stream stream;
  stream.next(crowd);
  stream.next({{person_at(100), 0.9F}, {person_at(400), 0.9F}});
  for (const Detection& one : stream.next({{person_at(100), 0.3F}, {person_at(400), 0.3F}})) {
    EXPECT_EQ(one.score, 0.3F) << "there was no room for more";
  }
  for (const Detection& one : stream.next(crowd)) {
    EXPECT_GT(one.score, 0.95F);
    EXPECT_LE(one.score, 1.0F);
  }
}

TEST(PersonMemory, KeepsScoresFromZeroToOne) {
  Stream stream;
  stream.next({{person_at(100), 1.0F}});
  const float sure = stream.next({{person_at(100), 1.0F}})[0].score;
  EXPECT_GT(sure, 0.99F);
  EXPECT_LE(sure, 1.0F);
}

}  // namespace
}  // namespace posed
