#include "drivers/yuv_conversion.h"

#include <vector>

#include <gtest/gtest.h>

namespace posed {
namespace {

// What the numbers mean is tested where cameras deliver them (v4l2_formats_test.cpp); here, that vectors and single pixels agree.

constexpr int kWidth = 2 * 64 + 22;  // whole vectors on every machine, and a rest
constexpr int kHeight = 4;

std::vector<std::uint8_t> noise(std::size_t size) {
  std::vector<std::uint8_t> bytes(size);
  for (std::size_t i = 0; i < size; ++i) {
    const std::size_t scattered = (i * 2654435761U) >> 11;
    bytes[i] = static_cast<std::uint8_t>(i % 5 == 0 ? (scattered % 2) * 255 : scattered);  // extremes among them
  }
  return bytes;
}

struct Picture {
  std::vector<std::uint8_t> bgr = std::vector<std::uint8_t>(3 * kWidth * kHeight);
  std::vector<std::uint8_t> gray = std::vector<std::uint8_t>(kWidth * kHeight);
  ImageView<std::uint8_t> bgr_view(int x, int width) { return {bgr.data() + 3 * x, width, kHeight, 3 * kWidth, 3}; }
  ImageView<std::uint8_t> gray_view(int x, int width) { return {gray.data() + x, width, kHeight, kWidth, 1}; }
};

class YuvConversion : public testing::TestWithParam<YuvCoding> {};

TEST_P(YuvConversion, YuyvInVectorsIsYuyvInPairs) {
  const std::vector<std::uint8_t> yuyv = noise(2 * kWidth * kHeight);
  Picture whole;
  Picture pairs;
  bgr_and_gray_from_yuyv({yuyv.data(), kWidth, kHeight, 2 * kWidth, 2}, GetParam(), whole.bgr_view(0, kWidth),
                         whole.gray_view(0, kWidth));
  for (int x = 0; x < kWidth; x += 2) {
    bgr_and_gray_from_yuyv({yuyv.data() + 2 * x, 2, kHeight, 2 * kWidth, 2}, GetParam(), pairs.bgr_view(x, 2),
                           pairs.gray_view(x, 2));
  }
  EXPECT_EQ(whole.bgr, pairs.bgr);
  EXPECT_EQ(whole.gray, pairs.gray);
}

TEST_P(YuvConversion, Nv12InVectorsIsNv12InPairs) {
  const std::vector<std::uint8_t> nv12 = noise(kWidth * kHeight * 3 / 2);
  const std::uint8_t* chroma = nv12.data() + kWidth * kHeight;
  Picture whole;
  Picture pairs;
  bgr_and_gray_from_nv12({nv12.data(), kWidth, kHeight, kWidth, 1}, {chroma, kWidth, kHeight / 2, kWidth, 1}, GetParam(),
                         whole.bgr_view(0, kWidth), whole.gray_view(0, kWidth));
  for (int x = 0; x < kWidth; x += 2) {
    bgr_and_gray_from_nv12({nv12.data() + x, 2, kHeight, kWidth, 1}, {chroma + x, 2, kHeight / 2, kWidth, 1}, GetParam(),
                           pairs.bgr_view(x, 2), pairs.gray_view(x, 2));
  }
  EXPECT_EQ(whole.bgr, pairs.bgr);
  EXPECT_EQ(whole.gray, pairs.gray);
}

INSTANTIATE_TEST_SUITE_P(Codings, YuvConversion,
                         testing::Values(YuvCoding{YuvMatrix::Bt601, YuvRange::Limited},
                                         YuvCoding{YuvMatrix::Bt601, YuvRange::Full},
                                         YuvCoding{YuvMatrix::Bt709, YuvRange::Limited},
                                         YuvCoding{YuvMatrix::Bt709, YuvRange::Full}));

}  // namespace
}  // namespace posed
