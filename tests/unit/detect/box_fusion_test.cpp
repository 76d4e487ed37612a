#include "detect/box_fusion.h"

#include <vector>

#include <gtest/gtest.h>

namespace posed {
namespace {

BoundingBox box_at(float x) {
  return {x, 100, x + 100, 400};
}

Detections look_of(const std::vector<Detection>& most_confident_first) {
  Detections found;
  found.assign(most_confident_first);
  return found;
}

std::vector<Detection> joined(const std::vector<std::vector<Detection>>& looks) {
  BoxFusion fusion(0.5F);
  Detections fused = look_of(looks.front());
  for (std::size_t i = 1; i < looks.size(); ++i) {
    fusion.add(look_of(looks[i]), i, fused);
  }
  return {fused.found().begin(), fused.found().end()};
}

TEST(BoxFusion, APersonIsWhereAllLooksSayInTheMean) {
  const std::vector<Detection> found = joined({{{box_at(100), 0.9F}}, {{box_at(110), 0.6F}}, {{box_at(120), 0.3F}}});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_FLOAT_EQ(found[0].score, 0.6F);
  const float x = (0.9F * 100 + 0.6F * 110 + 0.3F * 120) / 1.8F;
  EXPECT_NEAR(found[0].box.x_min, x, 1e-3F);
  EXPECT_NEAR(found[0].box.x_max, x + 100, 1e-3F);
  EXPECT_FLOAT_EQ(found[0].box.y_min, 100);
  EXPECT_FLOAT_EQ(found[0].box.y_max, 400);
}

TEST(BoxFusion, WhoeverALookDoesNotSeeIsBelievedTheLess) {
  EXPECT_EQ(joined({{{box_at(100), 0.8F}}, {}}), std::vector<Detection>({{box_at(100), 0.4F}}));
  EXPECT_EQ(joined({{}, {{box_at(100), 0.8F}}}), std::vector<Detection>({{box_at(100), 0.4F}}));
  const std::vector<Detection> late = joined({{}, {}, {{box_at(100), 0.9F}}});
  ASSERT_EQ(late.size(), 1U);
  EXPECT_FLOAT_EQ(late[0].score, 0.3F);
  EXPECT_TRUE(joined({{}, {}}).empty());
}

TEST(BoxFusion, TheSurestBoxesMeetFirst) {
  // By overlap alone the unsure box at 100 would take the sure one's place.
  const std::vector<Detection> found = joined({{{box_at(110), 0.9F}, {box_at(97), 0.05F}}, {{box_at(100), 0.9F}}});
  ASSERT_EQ(found.size(), 2U);
  EXPECT_FLOAT_EQ(found[0].score, 0.9F);
  EXPECT_FLOAT_EQ(found[0].box.x_min, 105);
  EXPECT_FLOAT_EQ(found[1].score, 0.025F);
}

TEST(BoxFusion, ALookFindsEachPersonOnce) {
  // Two boxes of an anchor may overlap well: two people. The other look sees them both, or one.
  const std::vector<Detection> two{{box_at(100), 0.9F}, {box_at(120), 0.8F}};
  EXPECT_EQ(joined({two, two}), two);
  const std::vector<Detection> found = joined({{{box_at(110), 0.8F}}, two});
  ASSERT_EQ(found.size(), 1U) << "who overlaps with somebody known is no other one";
  EXPECT_NEAR(found[0].score, 0.85F, 1e-6F);
}

TEST(BoxFusion, TheMostConfidentAreFirstAndFitIn) {
  EXPECT_EQ(joined({{{box_at(0), 0.9F}, {box_at(500), 0.5F}}, {{box_at(500), 0.5F}}}),
            std::vector<Detection>({{box_at(500), 0.5F}, {box_at(0), 0.45F}}));
  std::vector<Detection> left;
  std::vector<Detection> right;
  for (std::size_t i = 0; i < Detections::kCapacity; ++i) {
    left.push_back({box_at(static_cast<float>(200 * i)), 0.5F});
    right.push_back({box_at(-static_cast<float>(200 * (i + 1))), 0.6F});
  }
  const std::vector<Detection> found = joined({left, right});
  ASSERT_EQ(found.size(), Detections::kCapacity);
  EXPECT_FLOAT_EQ(found.back().score, 0.3F);
}

}  // namespace
}  // namespace posed
