#include "detect/multi_scale_detector.h"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/manual_clock.h"
#include "tests/unit/detect/fake_engine.h"

namespace posed {
namespace {

/// Two looks at an image of 128x64, three steps of a millisecond each.
class MultiScaleDetectorTest : public testing::Test {
 protected:
  MultiScaleDetectorTest() {
    std::vector<std::shared_ptr<ObjectDetector>> looks;
    for (int i = 0; i < 2; ++i) {
      auto engine = std::make_unique<test::FakeEngine>(clock);
      engines.push_back(engine.get());
      const DetectionThresholds of_looks = MultiScaleDetector::thresholds_of_looks(thresholds);
      looks.push_back(std::move(ObjectDetector::create(std::move(engine), {}, HeadKind::Boxes, 0, of_looks).value()));
    }
    detector = std::make_unique<MultiScaleDetector>(std::move(looks), thresholds);
  }

  /// A box about the middle of the image.
  void see(std::size_t look, float score) {
    const std::vector<float> row{32, 16, 10, 10, score, 1};
    std::copy(row.begin(), row.end(), engines[look]->values.begin());
  }

  MultiScaleOutcome look(TimeNs budget_ns = kNsPerSecond) {
    return detector->detect(image, {&clock, clock.now_ns() + budget_ns}, found).value();
  }

  const DetectionThresholds thresholds{0.4F, 0.5F};
  ManualClock clock;
  std::vector<test::FakeEngine*> engines;
  std::unique_ptr<MultiScaleDetector> detector;
  std::vector<std::uint8_t> pixels = std::vector<std::uint8_t>(128 * 64 * 3, 128);
  ImageView<const std::uint8_t> image{pixels.data(), 128, 64, 3L * 128, 3};
  Detections found;
};

TEST_F(MultiScaleDetectorTest, JoinsWhatTheSizesShow) {
  see(0, 0.9F);
  see(1, 0.5F);
  engines[1]->step_ns = 2 * kNsPerMs;
  const MultiScaleOutcome outcome = look();
  EXPECT_TRUE(outcome.finished);
  EXPECT_EQ(outcome.sizes_done, 2U);
  EXPECT_EQ(outcome.elapsed_ns, 9 * kNsPerMs);
  EXPECT_EQ(outcome.longest_step_ns, 2 * kNsPerMs);
  ASSERT_EQ(found.count, 1U);
  EXPECT_FLOAT_EQ(found.people[0].score, 0.7F);
}

TEST_F(MultiScaleDetectorTest, WhatOneSizeHardlySeesTheOtherMayMakeUpFor) {
  see(0, 0.2F);
  see(1, 0.7F);
  look();
  ASSERT_EQ(found.count, 1U);
  EXPECT_FLOAT_EQ(found.people[0].score, 0.45F);
  see(1, 0.5F);
  look();
  EXPECT_EQ(found.count, 0U) << "0.35 in the mean";
}

TEST_F(MultiScaleDetectorTest, LateInTheSecondSizeTheFirstOnesWordIsTaken) {
  see(0, 0.9F);
  see(1, 0.1F);
  const MultiScaleOutcome outcome = look(4 * kNsPerMs);
  EXPECT_FALSE(outcome.finished);
  EXPECT_EQ(outcome.sizes_done, 1U);
  ASSERT_EQ(found.count, 1U);
  EXPECT_FLOAT_EQ(found.people[0].score, 0.9F);
  see(0, 0.3F);
  look(4 * kNsPerMs);
  EXPECT_EQ(found.count, 0U) << "too little";
}

TEST_F(MultiScaleDetectorTest, LateInTheFirstSizeNothingIsKnown) {
  see(0, 0.9F);
  see(1, 0.9F);
  found.count = 7;  // of the frame before
  const MultiScaleOutcome outcome = look(2 * kNsPerMs);
  EXPECT_FALSE(outcome.finished);
  EXPECT_EQ(outcome.sizes_done, 0U);
  EXPECT_EQ(found.count, 0U);
  EXPECT_EQ(outcome.elapsed_ns, 2 * kNsPerMs) << "the second size is not begun";
}

}  // namespace
}  // namespace posed
