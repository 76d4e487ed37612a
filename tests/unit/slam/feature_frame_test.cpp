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

TEST_F(FeatureFrameTest, DepthIsThatWhenTheColourImageWasTaken) {
  add(320, 250);
  add(100, 80);
  frame.place(camera, depth_view, Se3(Eigen::Quaterniond::Identity(), {0, 0, -0.03}));  // the camera came 0.03 m nearer meanwhile
  EXPECT_NEAR(frame.depth_m()[0], 2.03F, 1e-5F);
  EXPECT_NEAR(frame.depth_m()[1], 2.03F, 1e-5F);
}

TEST_F(FeatureFrameTest, DepthOfASlantedSurfaceIsLookedUpWhereTheCameraSawIt) {
  // The plane z = 1.5 + x / 2, seen when the depth image was taken.
  const CameraIntrinsics& k = camera.intrinsics();
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 640; ++u) {
      const double x = (camera.undistort({static_cast<double>(u), static_cast<double>(v)}).x() - k.cx) / k.fx;
      depth[static_cast<std::size_t>(v * 640 + u)] = static_cast<float>(1.5 / (1 - x / 2));
    }
  }
  for (const float u : {100.0F, 320.0F, 500.0F}) {
    add(u, 240);
  }
  const Eigen::Vector3d moved(0.05, 0, 0);  // p_depth = p_color + moved: in the colour image the plane is z = 1.5 + (x + 0.05) / 2
  frame.place(camera, depth_view, Se3(Eigen::Quaterniond::Identity(), moved));
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const double x = (static_cast<double>(frame.ideal_pixels()[i].x()) - k.cx) / k.fx;
    EXPECT_NEAR(frame.depth_m()[i], 1.525 / (1 - x / 2), 0.003) << i;  // of the nearest pixel; 0.025 off if it were not moved
  }
}

TEST_F(FeatureFrameTest, WhereTheSurfaceIsLostBetweenTheImagesThereIsNoDepth) {
  for (int v = 0; v < 480; ++v) {
    std::fill_n(depth.begin() + v * 640 + 310, 330, 1.0F);  // something nearer, on the right
  }
  add(305, 240);
  add(200, 240);
  frame.place(camera, depth_view, Se3(Eigen::Quaterniond::Identity(), {0.05, 0, 0}));  // 13 pixels at 2 m
  EXPECT_EQ(frame.depth_m()[0], 0.0F) << "the edge has passed over it";
  EXPECT_NEAR(frame.depth_m()[1], 2.0F, 1e-5F);
}

TEST_F(FeatureFrameTest, WhatTheOtherImageDidNotShowHasNoDepth) {
  add(30, 240);
  add(320, 250);
  frame.place(camera, depth_view, Se3(Eigen::Quaterniond::Identity(), {-0.3, 0, 0}));  // 78 pixels at 2 m
  EXPECT_EQ(frame.depth_m()[0], 0.0F);
  EXPECT_NEAR(frame.depth_m()[1], 2.0F, 1e-5F);
  for (const Eigen::Vector3d& leap : {Eigen::Vector3d(1e9, 0, 0), Eigen::Vector3d(0, 0, -2), Eigen::Vector3d(0, 0, 1e30)}) {
    frame.place(camera, depth_view, Se3(Eigen::Quaterniond::Identity(), leap));
    EXPECT_EQ(frame.depth_m()[1], 0.0F) << "as of a velocity that cannot be";
  }
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
