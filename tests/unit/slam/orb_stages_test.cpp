#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "slam/orb_corners.h"
#include "slam/orb_pattern.h"
#include "slam/orb_pyramid.h"
#include "slam/orb_quadtree.h"
#include "tests/unit/slam/orb_test_images.h"

namespace posed {
namespace {

const OrbKernels& kernels() {
  return orb_kernels(best_simd_level());
}

cv::Mat as_mat(ImageView<std::uint8_t> image) {
  return cv::Mat(image.height, image.width, CV_8U, image.data, static_cast<std::size_t>(image.stride));
}

double largest_difference(const cv::Mat& a, const cv::Mat& b) {
  return cv::norm(a, b, cv::NORM_INF);
}

TEST(OrbPyramid, LevelsAreThoseOfBilinearResizing) {
  for (const auto& [width, height] : {std::pair{640, 480}, {333, 251}, {97, 61}}) {
    OrbPyramid pyramid(width, height, 8, 1.2, 33, kernels());
    pyramid.set_image(test::view(test::noise_image(width, height, 1)));
    for (int level = 1; level < pyramid.level_count(); ++level) {
      pyramid.resize_to(level);
      const cv::Mat ours = as_mat(pyramid.image(level));
      cv::Mat expected;
      cv::resize(as_mat(pyramid.image(level - 1)), expected, ours.size(), 0, 0, cv::INTER_LINEAR);
      EXPECT_LE(largest_difference(ours, expected), 1.0) << width << " level " << level;
    }
  }
}

TEST(OrbPyramid, LevelsShrinkByTheScaleAndEndAtTheSmallestSize) {
  const OrbPyramid large(640, 480, 8, 1.2, 33, kernels());
  ASSERT_EQ(large.level_count(), 8);
  EXPECT_EQ(large.image(7).width, 179);
  EXPECT_EQ(large.image(7).height, 134);
  const OrbPyramid small(97, 61, 8, 1.2, 33, kernels());
  ASSERT_EQ(small.level_count(), 4);
  EXPECT_EQ(small.image(3).height, 35);
}

TEST(OrbPyramid, SmoothingIsTheGaussianBlur) {
  for (const auto& [width, height] : {std::pair{640, 480}, {97, 61}}) {
    OrbPyramid pyramid(width, height, 1, 1.2, 33, kernels());
    const cv::Mat image = test::noise_image(width, height, 2);
    pyramid.set_image(test::view(image));
    pyramid.smooth(0);
    cv::Mat expected;
    cv::GaussianBlur(image, expected, {7, 7}, 2, 2, cv::BORDER_REFLECT_101);
    EXPECT_LE(largest_difference(as_mat(pyramid.smoothed(0)), expected), 1.0);
  }
}

// Every pixel with a score of at least t is a corner for OpenCV at the threshold t, and no other.
TEST(OrbCorners, ScoresSelectThePixelsThatOpenCvFinds) {
  const cv::Mat image = test::textured_image(203, 101, 3);
  PlaneStack planes({{image.cols, image.rows}});
  image.copyTo(as_mat(planes.plane(0)));
  for (const int threshold : {1, 7, 20, 60}) {
    std::vector<cv::KeyPoint> expected;
    cv::FAST(image, expected, threshold, false, cv::FastFeatureDetector::TYPE_9_16);
    std::set<std::pair<int, int>> expected_pixels;
    for (const cv::KeyPoint& keypoint : expected) {
      expected_pixels.emplace(static_cast<int>(keypoint.pt.x), static_cast<int>(keypoint.pt.y));
    }
    std::set<std::pair<int, int>> pixels;
    for (int y = 3; y < image.rows - 3; ++y) {
      std::vector<std::uint8_t> scores(static_cast<std::size_t>(image.cols + kRowSlack));
      kernels().fast_scores(planes.plane(0).row(y), planes.stride(), 3, image.cols - 3, 1, scores.data());
      for (int x = 3; x < image.cols - 3; ++x) {
        if (scores[static_cast<std::size_t>(x)] > threshold) {
          pixels.emplace(x, y);
        }
      }
    }
    EXPECT_GT(pixels.size(), 50u) << threshold;
    EXPECT_EQ(pixels, expected_pixels) << threshold;
  }
}

std::vector<Corner> detect(const cv::Mat& image, int border, int threshold, int minimum) {
  PlaneStack planes({{image.cols, image.rows}});
  image.copyTo(as_mat(planes.plane(0)));
  CornerDetector detector(image.cols, border, threshold, minimum, kernels());
  std::vector<Corner> corners;
  detector.detect(planes.plane(0), corners);
  return corners;
}

TEST(OrbCorners, CellsWithoutAStrongCornerKeepTheirWeakOnes) {
  // A row of dots, each in the middle of a cell: strong, weak, both (in one cell), too weak.
  cv::Mat image(96, 16 * 2 + 4 * 32, CV_8U, cv::Scalar(100));
  const auto dot = [&](int x, int y, int grey) { image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(grey); };
  dot(32, 32, 130);
  dot(64, 32, 110);
  dot(90, 26, 70);
  dot(102, 38, 90);
  dot(128, 32, 107);
  const std::vector<Corner> corners = detect(image, 16, 20, 7);
  std::vector<std::tuple<int, int, int>> found;
  for (const Corner& corner : corners) {
    found.emplace_back(corner.x, corner.y, corner.score);
  }
  EXPECT_EQ(found, (std::vector<std::tuple<int, int, int>>{{90, 26, 30}, {32, 32, 30}, {64, 32, 10}}));
}

TEST(OrbCorners, NoneWithinTheBorderAndNoTwoNeighbours) {
  const cv::Mat image = test::noise_image(143, 90, 4);
  const std::vector<Corner> corners = detect(image, 16, 20, 7);
  ASSERT_GT(corners.size(), 100u);
  ASSERT_LE(corners.size(), CornerDetector::max_corners(143, 90));
  std::set<std::pair<int, int>> taken;
  for (const Corner& corner : corners) {
    EXPECT_TRUE(corner.x >= 16 && corner.x < 143 - 16 && corner.y >= 16 && corner.y < 90 - 16);
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        EXPECT_FALSE(taken.contains({corner.x + dx, corner.y + dy}));
      }
    }
    taken.emplace(corner.x, corner.y);
  }
}

TEST(OrbCorners, FlatImageHasNone) {
  EXPECT_TRUE(detect(cv::Mat(80, 80, CV_8U, cv::Scalar(255)), 16, 20, 7).empty());
}

TEST(OrbQuadtree, TakesAllWhenThereAreNoMoreThanWanted) {
  CornerQuadtree tree(200, 100, 16, 10);
  const std::vector<Corner> corners = {{150, 20, 9}, {20, 20, 9}, {20, 80, 30}};
  std::vector<Corner> selected;
  tree.select(corners, 10, selected);
  ASSERT_EQ(selected.size(), 3u);
  EXPECT_EQ(selected[0].x, 20);
  EXPECT_EQ(selected[1].x, 150);
  tree.select(corners, 0, selected);
  EXPECT_TRUE(selected.empty());
}

TEST(OrbQuadtree, KeepsTheStrongestOfEachCell) {
  // Four clusters in the four quarters; the third corner of each is its strongest.
  CornerQuadtree tree(132, 132, 16, 4);
  std::vector<Corner> corners;
  for (const int y : {30, 100}) {
    for (const int x : {30, 100}) {
      for (int i = 0; i < 5; ++i) {
        corners.push_back({static_cast<std::uint16_t>(x + 2 * i), static_cast<std::uint16_t>(y),
                           static_cast<std::uint16_t>(i == 2 ? 40 : 20 + i)});
      }
    }
  }
  std::vector<Corner> selected;
  tree.select(corners, 4, selected);
  ASSERT_EQ(selected.size(), 4u);
  for (const Corner& corner : selected) {
    EXPECT_EQ(corner.score, 40);
  }
}

TEST(OrbQuadtree, CountStaysNearWhatIsWantedAndCoversTheImage) {
  // Nine of ten corners crowd in one corner of the image.
  cv::RNG random(5);
  std::vector<Corner> corners;
  for (int i = 0; i < 3000; ++i) {
    const int spread = i % 10 == 0 ? 1 : 8;
    corners.push_back({static_cast<std::uint16_t>(16 + random.uniform(0, 608 / spread)),
                       static_cast<std::uint16_t>(16 + random.uniform(0, 448 / spread)),
                       static_cast<std::uint16_t>(random.uniform(8, 90))});
  }
  for (const int wanted : {1, 2, 50, 217, 1000}) {
    CornerQuadtree tree(640, 480, 16, wanted);
    std::vector<Corner> selected;
    tree.select(corners, wanted, selected);
    EXPECT_GE(selected.size(), static_cast<std::size_t>(wanted));
    EXPECT_LE(selected.size(), static_cast<std::size_t>(wanted + 2));
    EXPECT_TRUE(std::is_sorted(selected.begin(), selected.end(),
                               [](const Corner& a, const Corner& b) { return std::tie(a.y, a.x) < std::tie(b.y, b.x); }));
    if (wanted >= 50) {
      const auto far = std::count_if(selected.begin(), selected.end(), [](const Corner& c) { return c.x > 320 || c.y > 240; });
      EXPECT_GT(far, static_cast<std::ptrdiff_t>(std::min<std::size_t>(selected.size() / 3, 150)));
    }
  }
}

TEST(OrbOrientation, IsTheAngleOfTheVector) {
  EXPECT_EQ(orientation_rad(0, 0), 0.0f);
  EXPECT_FLOAT_EQ(orientation_rad(-5, 0), std::numbers::pi_v<float>);
  for (int degrees = -179; degrees <= 180; ++degrees) {
    const double angle = degrees * std::numbers::pi / 180;
    const int x = static_cast<int>(std::lround(1e6 * std::cos(angle)));
    const int y = static_cast<int>(std::lround(1e6 * std::sin(angle)));
    EXPECT_NEAR(orientation_rad(x, y), std::atan2(y, x), 2e-5) << degrees;
  }
}

TEST(OrbPattern, TestsAreDistinctAndStayWithinThePatchAtEveryOrientation) {
  constexpr int kStride = 512;
  std::set<std::tuple<int, int, int, int>> tests;
  for (const BriefTest& t : kBriefPattern) {
    EXPECT_LE(t.ax * t.ax + t.ay * t.ay, kPatchRadius * kPatchRadius);
    EXPECT_LE(t.bx * t.bx + t.by * t.by, kPatchRadius * kPatchRadius);
    EXPECT_TRUE(t.ax != t.bx || t.ay != t.by);
    EXPECT_TRUE(tests.emplace(t.ax, t.ay, t.bx, t.by).second);
    EXPECT_FALSE(tests.contains({t.bx, t.by, t.ax, t.ay}));
  }
  const RotatedPattern pattern(kStride);
  for (int degrees = -180; degrees <= 180; degrees += 3) {
    const double angle = degrees * std::numbers::pi / 180;
    const std::int16_t* offsets = pattern.offsets(static_cast<float>(angle));
    for (std::size_t i = 0; i < kBriefTests; ++i) {
      // The offset is at most half an orientation step and a rounding away from the test's point turned exactly.
      const int y = static_cast<int>(std::floor((offsets[2 * i] + kStride / 2) / static_cast<double>(kStride)));
      const int x = offsets[2 * i] - y * kStride;
      const BriefTest& t = kBriefPattern[i];
      EXPECT_LE(std::abs(x), kPatchRadius);
      EXPECT_LE(std::abs(y), kPatchRadius);
      EXPECT_NEAR(x, std::cos(angle) * t.ax - std::sin(angle) * t.ay, 1.3);
      EXPECT_NEAR(y, std::sin(angle) * t.ax + std::cos(angle) * t.ay, 1.3);
    }
  }
}

}  // namespace
}  // namespace posed
