#include "detect/object_detector.h"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/manual_clock.h"
#include "tests/unit/detect/fake_engine.h"

namespace posed {
namespace {

using testing::HasSubstr;

using test::FakeEngine;

class ObjectDetectorTest : public testing::Test {
 protected:
  ObjectDetectorTest() {
    auto owned = std::make_unique<FakeEngine>(clock);
    engine = owned.get();
    detector = std::move(ObjectDetector::create(std::move(owned), {}, HeadKind::Boxes, 0, {0.4F, 0.5F}).value());
  }

  void set(std::size_t row, std::vector<float> values) {
    std::copy(values.begin(), values.end(), engine->values.begin() + static_cast<std::ptrdiff_t>(6 * row));
  }

  ManualClock clock;
  FakeEngine* engine;
  std::unique_ptr<ObjectDetector> detector;
  std::vector<std::uint8_t> pixels = std::vector<std::uint8_t>(128 * 64 * 3, 128);
  ImageView<const std::uint8_t> image{pixels.data(), 128, 64, 3L * 128, 3};
};

TEST_F(ObjectDetectorTest, GivesBoxesOfTheImageMostConfidentFirst) {
  set(0, {10, 10, 8, 8, 0.6F, 1});
  set(1, {40, 20, 10, 10, 0.9F, 1});
  set(2, {40.5F, 20, 10, 10, 0.8F, 1});  // the same again
  set(3, {60, 20, 10, 10, 0.3F, 1});
  Detections found;
  const auto outcome = detector->detect(image, {&clock}, found);
  ASSERT_TRUE(outcome && outcome->finished);
  ASSERT_EQ(found.count, 2U);
  EXPECT_EQ(found.people[0], (Detection{{69.5F, 29.5F, 89.5F, 49.5F}, 0.9F}));
  EXPECT_FLOAT_EQ(found.people[1].score, 0.6F);
  EXPECT_EQ(outcome->steps_run, 5U) << "letterbox, three steps of the network, decoding";
  EXPECT_GE(outcome->elapsed_ns, 3 * kNsPerMs);
}

TEST_F(ObjectDetectorTest, AnAbandonedFrameHasNoBoxes) {
  set(1, {40, 20, 10, 10, 0.9F, 1});
  Detections found;
  found.count = 7;  // of the frame before
  const auto outcome = detector->detect(image, {&clock, clock.now_ns() + kNsPerMs + 1}, found);
  ASSERT_TRUE(outcome);
  EXPECT_FALSE(outcome->finished);
  EXPECT_EQ(found.count, 0U);
  EXPECT_EQ(outcome->elapsed_ns, 2 * kNsPerMs) << "one step past the deadline";
}

TEST_F(ObjectDetectorTest, NamesTheEngineWhoseOutputsDoNotFit) {
  auto other = std::make_unique<FakeEngine>(clock);
  const auto refused = ObjectDetector::create(std::move(other), {}, HeadKind::Anchors, 0, {});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("fake: "));
  auto grey = std::make_unique<FakeEngine>(clock);
  grey->shape.channels = 1;
  EXPECT_THAT(ObjectDetector::create(std::move(grey), {}, HeadKind::Boxes, 0, {}).error().message, HasSubstr("1 channels"));
}

}  // namespace
}  // namespace posed
