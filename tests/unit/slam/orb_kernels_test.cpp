// Every kernel on every instruction set against its definition, written out pixel by pixel.
#include "slam/kernels/orb_kernels.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <initializer_list>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "slam/orb_pattern.h"
#include "slam/orb_pyramid.h"
#include "tests/unit/slam/orb_test_images.h"

namespace posed {
namespace {

constexpr int kWidths[] = {8, 15, 16, 17, 31, 33, 63, 64, 65, 97, 127, 160, 333, 640};

class OrbKernelsTest : public testing::TestWithParam<SimdLevel> {
 protected:
  const OrbKernels& kernels() const { return orb_kernels(GetParam()); }

  // Rows of noise with the room that kernels ask for, its contents arbitrary.
  static std::vector<std::uint8_t> noise(std::size_t size, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<std::uint8_t> values(size);
    std::generate(values.begin(), values.end(), [&] { return static_cast<std::uint8_t>(random()); });
    return values;
  }
};

INSTANTIATE_TEST_SUITE_P(Levels, OrbKernelsTest, testing::ValuesIn(supported_simd_levels().begin(), supported_simd_levels().end()),
                         [](const auto& test) { return std::string(to_string(test.param)); });

TEST_P(OrbKernelsTest, ResizesRowsHorizontally) {
  for (const int width : kWidths) {
    for (const double ratio : {1.2, 1.05, 1.9, 2.6}) {
      const auto padded = static_cast<std::size_t>(width + kRowSlack);
      const std::vector<std::uint8_t> row = noise(static_cast<std::size_t>(width * ratio) + 2 + kRowSlack, 1);
      std::vector<int> source(padded);
      std::vector<std::int16_t> weight(padded);
      std::vector<std::uint8_t> shuffle;
      bool shuffle_fits = true;
      for (std::size_t x = 0; x < padded; ++x) {
        source[x] = static_cast<int>(static_cast<double>(std::min(x, static_cast<std::size_t>(width - 1))) * ratio);
        weight[x] = static_cast<std::int16_t>(x * 7919 % 32768);
        const int offset = source[x] - source[x - x % 8];
        shuffle_fits = shuffle_fits && offset < 15;
        shuffle.insert(shuffle.end(), {static_cast<std::uint8_t>(offset), 0x80});
      }
      std::vector<std::int16_t> out(padded);
      kernels().resize_horizontal(row.data(), {source.data(), weight.data(), shuffle_fits ? shuffle.data() : nullptr}, width,
                                  out.data());
      for (std::size_t x = 0; x < static_cast<std::size_t>(width); ++x) {
        const int a = row[static_cast<std::size_t>(source[x])];
        const int b = row[static_cast<std::size_t>(source[x]) + 1];
        ASSERT_EQ(out[x], 64 * a + ((128 * (b - a) * weight[x]) >> 16)) << width << " " << ratio << " " << x;
      }
    }
  }
}

TEST_P(OrbKernelsTest, BlendsRowsVertically) {
  std::mt19937 random(2);
  for (const int width : kWidths) {
    std::vector<std::int16_t> upper(static_cast<std::size_t>(width + kRowSlack));
    std::vector<std::int16_t> lower(upper.size());
    for (std::size_t x = 0; x < upper.size(); ++x) {
      upper[x] = static_cast<std::int16_t>(random() % 16321);
      lower[x] = static_cast<std::int16_t>(random() % 16321);
    }
    upper[0] = lower[1] = 0;
    lower[0] = upper[1] = 16320;
    for (const std::int16_t weight : std::initializer_list<std::int16_t>{0, 1, 16384, 32767}) {
      std::vector<std::uint8_t> out(upper.size());
      kernels().resize_vertical(upper.data(), lower.data(), weight, width, out.data());
      for (std::size_t x = 0; x < static_cast<std::size_t>(width); ++x) {
        ASSERT_EQ(out[x], (upper[x] + ((2 * (lower[x] - upper[x]) * weight) >> 16) + 32) >> 6) << width << " " << x;
      }
    }
  }
}

// The score by its definition: try every threshold.
int fast_score(const cv::Mat& image, int x, int y) {
  constexpr int kCircle[16][2] = {{0, -3}, {1, -3}, {2, -2}, {3, -1}, {3, 0},  {3, 1},   {2, 2},   {1, 3},
                                  {0, 3},  {-1, 3}, {-2, 2}, {-3, 1}, {-3, 0}, {-3, -1}, {-2, -2}, {-1, -3}};
  const int centre = image.at<std::uint8_t>(y, x);
  const auto is_corner = [&](int threshold) {
    for (const int sign : {1, -1}) {
      int run = 0;
      for (int i = 0; i < 16 + 8; ++i) {
        const int pixel = image.at<std::uint8_t>(y + kCircle[i % 16][1], x + kCircle[i % 16][0]);
        run = sign * (pixel - centre) > threshold ? run + 1 : 0;
        if (run == 9) {
          return true;
        }
      }
    }
    return false;
  };
  int threshold = -1;
  while (is_corner(threshold + 1)) {
    ++threshold;
  }
  return threshold + 1;
}

TEST_P(OrbKernelsTest, ScoresAreTheLargestFastThreshold) {
  for (const int width : {40, 97, 160}) {
    cv::Mat image = test::textured_image(width, 60, static_cast<std::uint64_t>(width));
    test::noise_image(width, 20, 3).copyTo(image.rowRange(40, 60));
    image.at<std::uint8_t>(10, 10) = 255;
    const PlaneStack planes({{width, 60}});
    for (int y = 0; y < 60; ++y) {
      std::memcpy(planes.plane(0).row(y), image.ptr(y), static_cast<std::size_t>(width));
    }
    for (const int minimum : {1, 8, 21}) {
      for (int y = 3; y < 57; ++y) {
        std::vector<std::uint8_t> scores(static_cast<std::size_t>(width + kRowSlack), 77);
        const bool any = kernels().fast_scores(planes.plane(0).row(y), planes.stride(), 3, width - 3,
                                               static_cast<std::uint8_t>(minimum), scores.data());
        bool expected_any = false;
        for (int x = 3; x < width - 3; ++x) {
          const int score = fast_score(image, x, y);
          const int expected = score >= minimum ? score : 0;
          ASSERT_EQ(scores[static_cast<std::size_t>(x)], expected) << x << " " << y << " " << minimum;
          expected_any = expected_any || expected > 0;
        }
        // "Any" may be said of a row without (the quick test bounds the score from above), never the reverse.
        ASSERT_TRUE(any || !expected_any);
      }
    }
  }
}

TEST_P(OrbKernelsTest, SuppressesAllButTheFirstMaximum) {
  for (const int width : kWidths) {
    // Few different values, so that there are many ties and plateaus.
    const auto stride = static_cast<std::size_t>(width + kRowSlack);
    std::vector<std::uint8_t> scores = noise(3 * stride, 4);
    std::transform(scores.begin(), scores.end(), scores.begin(), [](std::uint8_t v) { return static_cast<std::uint8_t>(v % 6); });
    const auto at = [&](int x, int y) { return scores[static_cast<std::size_t>(y) * stride + static_cast<std::size_t>(x)]; };
    std::vector<std::uint16_t> expected;
    for (int x = 1; x < width - 1; ++x) {
      const int score = at(x, 1);
      bool maximum = score > 0;
      for (int i = 0; i < 9; ++i) {
        const int other = at(x + i % 3 - 1, i / 3);
        maximum = maximum && (i < 4 ? score > other : score >= other);
      }
      if (maximum) {
        expected.push_back(static_cast<std::uint16_t>(x));
      }
    }
    std::vector<std::uint16_t> columns(static_cast<std::size_t>(width));
    const int count = kernels().suppress_non_maxima(&scores[0], &scores[stride], &scores[2 * stride], 1, width - 1, columns.data());
    columns.resize(static_cast<std::size_t>(count));
    EXPECT_EQ(columns, expected) << width;
  }
}

TEST_P(OrbKernelsTest, BlursRows) {
  for (const int width : kWidths) {
    const auto stride = static_cast<std::size_t>(width + kRowSlack);
    std::vector<std::uint8_t> pixels = noise(kBlurTaps * stride, 5);
    if (width == 64) {
      std::fill(pixels.begin(), pixels.end(), std::uint8_t{255});  // the largest sums
    }
    const std::uint8_t* rows[kBlurTaps];
    for (std::size_t i = 0; i < kBlurTaps; ++i) {
      rows[i] = &pixels[i * stride];
    }
    std::vector<std::uint8_t> scratch(static_cast<std::size_t>(width + 2 * kRowSlack));
    std::vector<std::uint8_t> out(stride);
    kernels().blur_row(rows, width, scratch.data(), out.data());
    const auto vertical = [&](int x) {
      x = x < 0 ? -x : x;
      x = x >= width ? 2 * (width - 1) - x : x;
      int sum = 128;
      for (int i = 0; i < kBlurTaps; ++i) {
        sum += kBlurWeights[i] * rows[i][x];
      }
      return sum / 256;
    };
    for (int x = 0; x < width; ++x) {
      int sum = 128;
      for (int i = 0; i < kBlurTaps; ++i) {
        sum += kBlurWeights[i] * vertical(x + i - kBlurTaps / 2);
      }
      ASSERT_EQ(out[static_cast<std::size_t>(x)], sum / 256) << width << " " << x;
    }
  }
}

TEST_P(OrbKernelsTest, MomentsAreSumsOverTheDisc) {
  cv::Mat image = test::noise_image(200, 40, 6);
  image(cv::Rect(150, 0, 50, 20)) = 0;  // the largest moments: all dark above, all bright below
  image(cv::Rect(150, 20, 50, 20)) = 255;
  for (const int x : {15, 16, 40, 101, 175}) {
    int expected_10 = 0;
    int expected_01 = 0;
    int area = 0;
    for (int v = -kPatchRadius; v <= kPatchRadius; ++v) {
      for (int u = -disc_half_width(v); u <= disc_half_width(v); ++u) {
        expected_10 += u * image.at<std::uint8_t>(20 + v, x + u);
        expected_01 += v * image.at<std::uint8_t>(20 + v, x + u);
        ++area;
      }
    }
    EXPECT_NEAR(area, 3.14159 * 15.5 * 15.5, 12);
    int m10 = 0;
    int m01 = 0;
    kernels().moments(image.ptr(20) + x, static_cast<std::ptrdiff_t>(image.step), &m10, &m01);
    EXPECT_EQ(m10, expected_10) << x;
    EXPECT_EQ(m01, expected_01) << x;
  }
}

TEST_P(OrbKernelsTest, DescriptorBitsAreTheTests) {
  const cv::Mat image = test::noise_image(64, 64, 8);
  const RotatedPattern pattern(static_cast<std::ptrdiff_t>(image.step));
  for (const float angle_rad : {0.0f, 1.0f, 3.1415926f, -3.1415925f, -1.5707964f}) {
    const std::int16_t* offsets = pattern.offsets(angle_rad);
    const std::uint8_t* centre = image.ptr(32) + 32;
    std::uint64_t words[4] = {};
    kernels().describe(centre, offsets, words);
    for (std::size_t i = 0; i < kBriefTests; ++i) {
      ASSERT_EQ(words[i / 64] >> (i % 64) & 1u, centre[offsets[2 * i]] < centre[offsets[2 * i + 1]] ? 1u : 0u)
          << angle_rad << " " << i;
    }
  }
}

}  // namespace
}  // namespace posed
