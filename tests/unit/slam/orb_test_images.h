#pragma once

#include <cstdint>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/image_view.h"

namespace posed::test {

/// Every grey level equally likely, no pixel like its neighbour: the hardest case for arithmetic, not an image.
inline cv::Mat noise_image(int width, int height, std::uint64_t seed) {
  cv::RNG random(seed);
  cv::Mat image(height, width, CV_8U);
  random.fill(image, cv::RNG::UNIFORM, 0, 256);
  return image;
}

/// Rectangles of random place, size, direction and grey, slightly blurred: corners of all strengths and sizes all over the image.
inline cv::Mat textured_image(int width, int height, std::uint64_t seed) {
  cv::RNG random(seed);
  cv::Mat image(height, width, CV_8U, cv::Scalar(128));
  const int count = width * height / 400;
  for (int i = 0; i < count; ++i) {
    const cv::Point2f centre(random.uniform(0.0f, static_cast<float>(width)), random.uniform(0.0f, static_cast<float>(height)));
    const cv::Size2f size(random.uniform(4.0f, 40.0f), random.uniform(4.0f, 40.0f));
    cv::Point2f corners[4];
    cv::RotatedRect(centre, size, random.uniform(0.0f, 360.0f)).points(corners);
    const cv::Point polygon[4] = {corners[0], corners[1], corners[2], corners[3]};
    cv::fillConvexPoly(image, polygon, 4, cv::Scalar(random.uniform(0, 256)), cv::LINE_AA);
  }
  cv::GaussianBlur(image, image, {3, 3}, 0.7);
  return image;
}

inline ImageView<const std::uint8_t> view(const cv::Mat& image) {
  return {image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step), 1};
}

}  // namespace posed::test
