#include <vector>

#include <gtest/gtest.h>

#include "slam/orb_extractor.h"
#include "tests/unit/slam/allocation_counter.h"
#include "tests/unit/slam/orb_test_images.h"

namespace posed {
namespace {

TEST(OrbAllocation, NoneOnceTheOutputHasGrown) {
  const std::vector<cv::Mat> images = {cv::Mat(240, 320, CV_8U, cv::Scalar(9)), test::textured_image(320, 240, 1),
                                       test::noise_image(320, 240, 2)};
  const long before_construction = test::allocation_count();
  OrbExtractor extractor({}, 320, 240);
  EXPECT_GT(test::allocation_count(), before_construction) << "the counter does not count";
  Features features;
  extractor.extract(test::view(images[0]), features);  // warm-up, and on the easiest image
  const long before = test::allocation_count();
  for (const cv::Mat& image : images) {
    extractor.extract(test::view(image), features);
  }
  EXPECT_EQ(test::allocation_count(), before);
  EXPECT_GT(features.keypoints.size(), 500u);
}

}  // namespace
}  // namespace posed
