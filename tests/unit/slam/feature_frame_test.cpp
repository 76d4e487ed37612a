#include "slam/feature_frame.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/freiburg1_camera.h"

namespace posed {
namespace {

struct FeatureFrameTest : testing::Test {
  PinholeCamera camera{freiburg1_camera()};
  FeatureFrame frame{camera, 2000};
  std::vector<float> depth = std::vector<float>(640 * 480, 2.0F);
  ImageView<const float> depth_view{depth.data(), 640, 480, 640, 1};

  void add(float x, float y, int level = 0) {
    Keypoint k;
    k.x = x;
    k.y = y;
    k.level = static_cast<std::uint8_t>(level);
    frame.features().keypoints.push_back(k);
    frame.features().descriptors.emplace_back();
  }
};

TEST_F(FeatureFrameTest, SearchFindsWhatAScanFinds) {
  std::mt19937 generator(1);
  std::uniform_real_distribution<float> x(0, 639);
  std::uniform_real_distribution<float> y(0, 479);
  std::uniform_int_distribution<int> level(0, 7);
  for (int i = 0; i < 1000; ++i) {
    add(x(generator), y(generator), level(generator));
  }
  frame.place(camera, depth_view);
  std::vector<std::uint16_t> scratch;
  for (int trial = 0; trial < 300; ++trial) {
    const float u = x(generator) * 1.2F - 60;  // also outside of the image
    const float v = y(generator) * 1.2F - 40;
    const float radius = x(generator) / 10;
    const int lowest = level(generator);
    std::vector<std::uint16_t> expected;
    for (std::size_t i = 0; i < frame.size(); ++i) {
      const Eigen::Vector2f p = frame.ideal_pixels()[i];
      const int l = frame.features().keypoints[i].level;
      if (std::abs(p.x() - u) <= radius && std::abs(p.y() - v) <= radius && l >= lowest && l <= lowest + 2) {
        expected.push_back(static_cast<std::uint16_t>(i));
      }
    }
    const auto found = frame.search(u, v, radius, lowest, lowest + 2, scratch);
    EXPECT_THAT(std::vector(found.begin(), found.end()), testing::UnorderedElementsAreArray(expected));
  }
}

TEST_F(FeatureFrameTest, UndistortsAndLooksDepthUpAtTheSeenPixel) {
  depth[100 * 640 + 50] = 3.5F;
  add(50.3F, 99.8F);
  frame.place(camera, depth_view);
  EXPECT_FLOAT_EQ(frame.depth_m()[0], 3.5F);
  EXPECT_FLOAT_EQ(frame.disparity()[0], static_cast<float>(camera.intrinsics().baseline_fx / 3.5));
  const Eigen::Vector2d back = camera.distort(frame.ideal_pixels()[0].cast<double>());
  EXPECT_NEAR(back.x(), 50.3, 1e-3);
  EXPECT_NEAR(back.y(), 99.8, 1e-3);
}

TEST_F(FeatureFrameTest, TreatsMissingAndBrokenDepthAsNone) {
  for (const float broken : {0.0F, -1.0F, std::nanf(""), INFINITY}) {
    depth[0] = broken;
    frame.features() = Features{};
    add(0, 0);
    frame.place(camera, depth_view);
    EXPECT_EQ(frame.depth_m()[0], 0.0F) << broken;
    EXPECT_EQ(frame.disparity()[0], 0.0F) << broken;
  }
}

TEST_F(FeatureFrameTest, AcceptsAFrameWithoutFeatures) {
  frame.place(camera, depth_view);
  std::vector<std::uint16_t> scratch;
  EXPECT_TRUE(frame.search(320, 240, 1000, 0, 7, scratch).empty());
}

TEST_F(FeatureFrameTest, AcceptsKeypointsAtTheVeryBorder) {
  add(0, 0);
  add(639.4F, 479.4F);
  add(-0.4F, 479.4F);
  frame.place(camera, depth_view);
  EXPECT_THAT(frame.depth_m(), testing::Each(2.0F));
  std::vector<std::uint16_t> scratch;
  EXPECT_EQ(frame.search(320, 240, 1000, 0, 7, scratch).size(), 3U);
}

}  // namespace
}  // namespace posed
