#include "slam/orb_extractor.h"

#include <array>
#include <cmath>
#include <cstring>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "tests/unit/slam/orb_test_images.h"

namespace posed {
namespace {

Features extract(const cv::Mat& image, const TrackerConfig& config = {}, SimdLevel level = best_simd_level()) {
  OrbExtractor extractor(config, image.cols, image.rows, level);
  Features features;
  extractor.extract(test::view(image), features);
  return features;
}

void expect_identical(const Features& a, const Features& b, const std::string& what) {
  ASSERT_EQ(a.keypoints.size(), b.keypoints.size()) << what;
  EXPECT_EQ(a.descriptors, b.descriptors) << what;
  for (std::size_t i = 0; i < a.keypoints.size(); ++i) {
    const auto fields = [](const Keypoint& k) { return std::tuple(k.x, k.y, k.angle_rad, k.level, k.response); };
    ASSERT_EQ(fields(a.keypoints[i]), fields(b.keypoints[i])) << what << " " << i;
  }
}

TEST(OrbExtractor, FindsTheNumberAskedForSpreadOverTheImage) {
  const cv::Mat image = test::textured_image(640, 480, 1);
  const Features features = extract(image);
  EXPECT_EQ(features.keypoints.size(), features.descriptors.size());
  EXPECT_GE(features.keypoints.size(), 1000u);
  EXPECT_LE(features.keypoints.size(), 1016u);
  std::array<int, 4> by_quarter{};
  std::array<int, 8> by_level{};
  for (const Keypoint& keypoint : features.keypoints) {
    ++by_quarter[(keypoint.x >= 320 ? 1u : 0u) + (keypoint.y >= 240 ? 2u : 0u)];
    ++by_level[keypoint.level];
    EXPECT_GE(keypoint.response, 7);
    EXPECT_LE(std::abs(keypoint.angle_rad), 3.1416f);
    EXPECT_TRUE(keypoint.x >= 15.5 && keypoint.x < 624 && keypoint.y >= 15.5 && keypoint.y < 464);
  }
  for (const int count : by_quarter) {
    EXPECT_GT(count, 200);
  }
  EXPECT_NEAR(by_level[0], 217, 3);
  EXPECT_NEAR(by_level[7], 61, 3);
}

TEST(OrbExtractor, EveryInstructionSetGivesTheSameBits) {
  for (const auto& [width, height] : {std::pair{640, 480}, {160, 120}, {97, 61}, {333, 251}, {1241, 100}}) {
    const cv::Mat image = test::textured_image(width, height, 2);
    const Features reference = extract(image, {}, SimdLevel::Baseline);
    EXPECT_GT(reference.keypoints.size(), 10u) << width;
    for (const SimdLevel level : supported_simd_levels()) {
      expect_identical(reference, extract(image, {}, level), to_string(level) + std::string(" ") + std::to_string(width));
    }
  }
}

TEST(OrbExtractor, DependsOnThePixelsAlone) {
  const cv::Mat image = test::textured_image(320, 240, 3);
  OrbExtractor extractor({}, 320, 240);
  Features features;
  extractor.extract(test::view(test::noise_image(320, 240, 4)), features);
  extractor.extract(test::view(image), features);
  expect_identical(features, extract(image), "after another image");
  cv::Mat wide(240, 400, CV_8U, cv::Scalar(17));
  image.copyTo(wide.colRange(3, 323));
  expect_identical(features, extract(wide.colRange(3, 323)), "of another stride, not aligned");
  OrbExtractor moved = std::move(extractor);
  moved.extract(test::view(image), features);
  expect_identical(features, extract(image), "moved");
}

TEST(OrbExtractor, IsSortedByLevelThenPosition) {
  const Features features = extract(test::textured_image(320, 240, 5));
  for (std::size_t i = 1; i < features.keypoints.size(); ++i) {
    const auto key = [](const Keypoint& k) { return std::tuple(k.level, k.y, k.x); };
    EXPECT_LT(key(features.keypoints[i - 1]), key(features.keypoints[i]));
  }
}

TEST(OrbExtractor, FlatImageHasNoFeatures) {
  for (const int grey : {0, 128, 255}) {
    EXPECT_TRUE(extract(cv::Mat(480, 640, CV_8U, cv::Scalar(grey))).keypoints.empty());
  }
}

TEST(OrbExtractor, ImagesTooSmallForAPatchHaveNoFeatures) {
  EXPECT_TRUE(extract(test::noise_image(40, 32, 6)).keypoints.empty());
  EXPECT_FALSE(extract(test::noise_image(40, 33, 6)).keypoints.empty());
}

TEST(OrbExtractor, CoarseLevelsLocateAtTheScaleOfTheImage) {
  // One bright square that only its corners distinguish; its four corners are found (FAST answers up to 3 pixels off a perfect corner).
  cv::Mat image(480, 640, CV_8U, cv::Scalar(60));
  image(cv::Rect(250, 180, 120, 90)) = 200;
  const Features features = extract(image);
  ASSERT_GE(features.keypoints.size(), 4u * 8u);
  for (const Keypoint& keypoint : features.keypoints) {
    double nearest = 1e9;
    for (const auto& [x, y] : {std::pair{249.5, 179.5}, {369.5, 179.5}, {249.5, 269.5}, {369.5, 269.5}}) {
      nearest = std::min(nearest, std::hypot(keypoint.x - x, keypoint.y - y));
    }
    EXPECT_LE(nearest, 3.0 * std::pow(1.2, keypoint.level)) << static_cast<int>(keypoint.level);
  }
}

TEST(OrbExtractor, OrientationPointsToTheBrightSide) {
  // The corner of a bright square: brightness lies diagonally inwards, 45 degrees (y down) at the upper left corner.
  cv::Mat image(200, 200, CV_8U, cv::Scalar(50));
  image(cv::Rect(80, 80, 60, 60)) = 220;
  TrackerConfig config;
  config.pyramid_levels = 1;
  bool seen = false;
  for (const Keypoint& keypoint : extract(image, config).keypoints) {
    if (std::hypot(keypoint.x - 80, keypoint.y - 80) < 3) {
      EXPECT_NEAR(keypoint.angle_rad, 0.785, 0.15);
      seen = true;
    }
  }
  EXPECT_TRUE(seen);
}

TEST(OrbExtractor, ConfigurationRules) {
  const cv::Mat image = test::textured_image(320, 240, 7);
  TrackerConfig config;
  config.features = 200;
  config.pyramid_levels = 3;
  config.pyramid_scale = 1.5;
  config.fast_threshold = 40;
  config.fast_threshold_minimum = 15;
  const Features features = extract(image, config);
  EXPECT_GE(features.keypoints.size(), 200u);
  EXPECT_LE(features.keypoints.size(), 206u);
  for (const Keypoint& keypoint : features.keypoints) {
    EXPECT_LT(keypoint.level, 3);
    EXPECT_GE(keypoint.response, 15);
  }
}

}  // namespace
}  // namespace posed
