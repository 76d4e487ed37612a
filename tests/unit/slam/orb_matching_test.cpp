// What descriptors are for: matches between two views of which the true correspondence is known, beside OpenCV's ORB.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "slam/descriptor.h"
#include "slam/orb_extractor.h"
#include "tests/unit/slam/orb_test_images.h"

namespace posed {
namespace {

struct View {
  std::vector<cv::Point2f> points;
  std::vector<float> scales;  ///< of the pyramid level
  std::vector<float> angles_deg;
  std::vector<int> levels;
  std::vector<Descriptor> descriptors;
};

View our_view(const cv::Mat& image) {
  OrbExtractor extractor({}, image.cols, image.rows);
  Features features;
  extractor.extract(test::view(image), features);
  View view;
  view.descriptors = features.descriptors;
  for (const Keypoint& keypoint : features.keypoints) {
    view.points.emplace_back(keypoint.x, keypoint.y);
    view.scales.push_back(std::pow(1.2f, static_cast<float>(keypoint.level)));
    view.angles_deg.push_back(keypoint.angle_rad * 180.0f / std::numbers::pi_v<float>);
    view.levels.push_back(keypoint.level);
  }
  return view;
}

// The same keypoints with OpenCV's descriptors, so that nothing but the descriptors is compared.
View with_opencv_descriptors(const cv::Mat& image, const View& ours) {
  std::vector<cv::KeyPoint> keypoints;
  for (std::size_t i = 0; i < ours.points.size(); ++i) {
    const float scale = ours.scales[i];
    // OpenCV lets the centres of the corner pixels of all levels coincide, we the corners themselves.
    const cv::Point2f offset(0.5f * (1.0f - scale), 0.5f * (1.0f - scale));
    keypoints.emplace_back(ours.points[i] + offset, 31.0f * scale, ours.angles_deg[i], 1.0f, ours.levels[i], static_cast<int>(i));
  }
  cv::Mat descriptors;
  cv::ORB::create(1000, 1.2f, 8, 0)->compute(image, keypoints, descriptors);
  View view;
  for (std::size_t row = 0; row < keypoints.size(); ++row) {
    const auto i = static_cast<std::size_t>(keypoints[row].class_id);
    view.points.push_back(ours.points[i]);
    view.scales.push_back(ours.scales[i]);
    std::copy_n(descriptors.ptr(static_cast<int>(row)), sizeof(Descriptor),
                reinterpret_cast<std::uint8_t*>(view.descriptors.emplace_back().data()));
  }
  return view;
}

struct MatchQuality {
  int matches = 0;
  int correct = 0;
  double precision() const { return matches == 0 ? 0.0 : static_cast<double>(correct) / matches; }
};

// Nearest neighbours by descriptor that are so in both directions; correct if within 2.5 pixels of the coarser level of the truth.
MatchQuality match(const View& from, const View& to, const cv::Matx23d& truth) {
  const auto nearest = [](const Descriptor& query, const std::vector<Descriptor>& others) {
    const auto closest = std::min_element(others.begin(), others.end(), [&](const Descriptor& a, const Descriptor& b) {
      return hamming_distance(query, a) < hamming_distance(query, b);
    });
    return static_cast<std::size_t>(closest - others.begin());
  };
  MatchQuality quality;
  for (std::size_t i = 0; i < from.points.size(); ++i) {
    const std::size_t j = nearest(from.descriptors[i], to.descriptors);
    if (nearest(to.descriptors[j], from.descriptors) != i || hamming_distance(from.descriptors[i], to.descriptors[j]) > 64) {
      continue;
    }
    const cv::Vec2d expected = truth * cv::Vec3d(from.points[i].x, from.points[i].y, 1.0);
    const double error = std::hypot(expected[0] - to.points[j].x, expected[1] - to.points[j].y);
    ++quality.matches;
    quality.correct += error <= 2.5 * std::max(from.scales[i], to.scales[j]) ? 1 : 0;
  }
  return quality;
}

class OrbMatchingTest : public testing::TestWithParam<std::pair<double, double>> {};

INSTANTIATE_TEST_SUITE_P(Warps, OrbMatchingTest,
                         testing::Values(std::pair{7.0, 1.0}, std::pair{45.0, 1.0}, std::pair{93.0, 1.1}, std::pair{170.0, 0.8},
                                         std::pair{-30.0, 1.3}),
                         [](const auto& test) { return "Case" + std::to_string(test.index); });

TEST_P(OrbMatchingTest, TurnedAndScaledImagesMatchAboutAsWellAsWithOpenCvsDescriptors) {
  const auto [angle_deg, scale] = GetParam();
  const cv::Mat image = test::textured_image(320, 240, 11);
  const cv::Matx23d truth = cv::getRotationMatrix2D({159.5f, 119.5f}, angle_deg, scale);
  cv::Mat warped;
  cv::warpAffine(image, warped, truth, image.size(), cv::INTER_LINEAR, cv::BORDER_REFLECT);
  cv::RNG random(12);
  cv::Mat noise(image.size(), CV_16S);
  random.fill(noise, cv::RNG::NORMAL, 0, 3);
  cv::add(warped, noise, warped, cv::noArray(), CV_8U);

  const View ours_from = our_view(image);
  const View ours_to = our_view(warped);
  const MatchQuality ours = match(ours_from, ours_to, truth);
  const MatchQuality opencv = match(with_opencv_descriptors(image, ours_from), with_opencv_descriptors(warped, ours_to), truth);
  RecordProperty("ours", std::to_string(ours.correct) + " of " + std::to_string(ours.matches));
  RecordProperty("opencv", std::to_string(opencv.correct) + " of " + std::to_string(opencv.matches));
  EXPECT_GT(ours.correct, 250);
  EXPECT_GE(ours.precision(), opencv.precision() - 0.02);
  EXPECT_GE(ours.correct, opencv.correct * 9 / 10);
}

}  // namespace
}  // namespace posed
