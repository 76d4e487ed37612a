#include "drivers/pixel_conversion.h"

#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

namespace posed {
namespace {

TEST(PixelConversion, GrayIsTheLumaOfBt601) {
  constexpr int kSteps = 52;  // every fifth value of each channel
  std::vector<std::uint8_t> bgr;
  for (int b = 0; b < kSteps; ++b) {
    for (int g = 0; g < kSteps; ++g) {
      for (int r = 0; r < kSteps; ++r) {
        bgr.insert(bgr.end(),
                   {static_cast<std::uint8_t>(5 * b), static_cast<std::uint8_t>(5 * g), static_cast<std::uint8_t>(5 * r)});
      }
    }
  }
  constexpr int kWidth = kSteps * kSteps;
  std::vector<std::uint8_t> gray(bgr.size() / 3);
  gray_from_bgr({bgr.data(), kWidth, kSteps, 3 * kWidth, 3}, {gray.data(), kWidth, kSteps, kWidth, 1});
  for (std::size_t i = 0; i < gray.size(); ++i) {
    const double luma = 0.114 * bgr[3 * i] + 0.587 * bgr[3 * i + 1] + 0.299 * bgr[3 * i + 2];
    ASSERT_NEAR(gray[i], luma, 0.51) << "pixel " << i;
  }
  EXPECT_EQ(gray.back(), 255);
  EXPECT_EQ(gray.front(), 0);
}

TEST(PixelConversion, GreyStaysGrey) {
  std::vector<std::uint8_t> gray(256);
  std::iota(gray.begin(), gray.end(), std::uint8_t{0});
  std::vector<std::uint8_t> bgr(3 * 256);
  std::vector<std::uint8_t> again(256);
  bgr_from_gray({gray.data(), 256, 1, 256, 1}, {bgr.data(), 256, 1, 768, 3});
  gray_from_bgr({bgr.data(), 256, 1, 768, 3}, {again.data(), 256, 1, 256, 1});
  EXPECT_EQ(again, gray);
}

TEST(PixelConversion, RowsMayBePadded) {
  const std::vector<std::uint8_t> bgr{1, 2, 3, 99, 4, 5, 6, 99};  // one pixel a row
  std::vector<std::uint8_t> rgb(6);
  swap_red_blue({bgr.data(), 1, 2, 4, 3}, {rgb.data(), 1, 2, 3, 3});
  EXPECT_EQ(rgb, (std::vector<std::uint8_t>{3, 2, 1, 6, 5, 4}));
}

class DepthUnits : public testing::TestWithParam<double> {};

TEST_P(DepthUnits, EveryRawValueSurvives) {
  std::vector<std::uint16_t> raw(65536);
  std::iota(raw.begin(), raw.end(), std::uint16_t{0});
  std::vector<float> depth_m(raw.size());
  std::vector<std::uint16_t> again(raw.size());
  depth_from_raw({raw.data(), 65536, 1, 65536, 1}, GetParam(), {depth_m.data(), 65536, 1, 65536, 1});
  raw_from_depth({depth_m.data(), 65536, 1, 65536, 1}, GetParam(), {again.data(), 65536, 1, 65536, 1});
  EXPECT_EQ(again, raw);
  EXPECT_EQ(depth_m[0], 0.0F);
  EXPECT_EQ(depth_m[12345], static_cast<float>(12345.0 / GetParam()));
}
INSTANTIATE_TEST_SUITE_P(PixelConversion, DepthUnits, testing::Values(5000.0, 1000.0, 5208.0, 256.0));

TEST(PixelConversion, WhatSixteenBitsCannotHoldIsInvalid) {
  const std::vector<float> depth_m{13.107F, 13.2F, -1.0F, std::numeric_limits<float>::quiet_NaN(),
                                   std::numeric_limits<float>::infinity()};
  std::vector<std::uint16_t> raw(depth_m.size(), 7);
  raw_from_depth({depth_m.data(), 5, 1, 5, 1}, 5000.0, {raw.data(), 5, 1, 5, 1});
  EXPECT_EQ(raw, (std::vector<std::uint16_t>{65535, 0, 0, 0, 0}));
}

}  // namespace
}  // namespace posed
