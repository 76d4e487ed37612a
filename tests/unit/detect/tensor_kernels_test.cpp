#include "detect/kernels/tensor_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace posed {
namespace {

/// Each of the instruction sets of this machine; odd sizes, so that what is left after whole vectors is reached.
class TensorKernelsOf : public ::testing::TestWithParam<SimdLevel> {
 protected:
  const TensorKernels& kernels() const { return tensor_kernels(GetParam()); }

  std::vector<float> random_floats(std::size_t count) {
    std::vector<float> values(count);
    std::generate(values.begin(), values.end(), [&] { return static_cast<float>(random_() % 2001) / 500.0F - 2.0F; });
    return values;
  }
  std::vector<std::uint8_t> random_bytes(std::size_t count) {
    std::vector<std::uint8_t> values(count);
    std::generate(values.begin(), values.end(), [&] { return static_cast<std::uint8_t>(random_()); });
    return values;
  }

 private:
  std::mt19937 random_{1};
};

INSTANTIATE_TEST_SUITE_P(EachInstructionSet, TensorKernelsOf,
                         ::testing::ValuesIn(supported_simd_levels().begin(), supported_simd_levels().end()));

int rounded(float value) {
  return static_cast<int>(std::floor(std::clamp(value, 0.0F, 255.0F) + 0.5F));
}

TEST_P(TensorKernelsOf, InterleavesAndSplitsImages) {
  constexpr int kChannels = 3;
  constexpr int kHeight = 6;
  constexpr int kWidth = 290;  // more than one chunk of a row
  const std::vector<float> planes = random_floats(kChannels * kHeight * kWidth);
  for (const int step : {1, 2}) {
    std::vector<float> out(planes.size());
    kernels().interleave(planes.data(), kChannels, kHeight, kWidth, step, out.data());
    const Quantization to{0.02F, 100};
    std::vector<std::uint8_t> bytes(planes.size());
    kernels().interleave_u8(planes.data(), kChannels, kHeight, kWidth, step, to, bytes.data());
    std::size_t i = 0;
    for (int y = 0; y < kHeight; y += step) {
      for (int x = 0; x < kWidth; x += step) {
        for (int c = 0; c < kChannels * step * step; ++c, ++i) {
          const int offset = c / kChannels;  // (0,0), (1,0), (0,1), (1,1)
          const float expected =
              planes[static_cast<std::size_t>((c % kChannels * kHeight + y + offset % 2) * kWidth + x + offset / 2)];
          ASSERT_EQ(out[i], expected);
          ASSERT_NEAR(bytes[i], rounded(expected / to.scale + 100), 1);
        }
      }
    }
  }
}

TEST_P(TensorKernelsOf, DeinterleaveUndoesInterleave) {
  const std::vector<float> planes = random_floats(5 * 7 * 9);
  std::vector<float> interleaved(planes.size());
  std::vector<float> again(planes.size());
  kernels().interleave(planes.data(), 5, 7, 9, 1, interleaved.data());
  kernels().deinterleave(interleaved.data(), 5, 63, again.data());
  EXPECT_EQ(again, planes);
}

TEST_P(TensorKernelsOf, ConcatenatesPixelsOfAnySize) {
  constexpr std::size_t kPixels = 11;
  const std::vector<std::size_t> sizes{4, 8, 16, 32, 64, 128, 256, 3, 20};
  std::vector<std::vector<std::uint8_t>> parts;
  std::vector<ConcatPart> views;
  std::size_t stride = 0;
  for (const std::size_t size : sizes) {
    parts.push_back(random_bytes(kPixels * size));
    views.push_back({parts.back().data(), size});
    stride += size;
  }
  std::vector<std::uint8_t> out(kPixels * stride);
  kernels().concat(views.data(), views.size(), kPixels, out.data());
  auto place = out.begin();
  for (std::size_t pixel = 0; pixel < kPixels; ++pixel) {
    for (std::size_t i = 0; i < sizes.size(); ++i) {
      const auto begin = parts[i].begin() + static_cast<std::ptrdiff_t>(pixel * sizes[i]);
      ASSERT_TRUE(std::equal(begin, begin + static_cast<std::ptrdiff_t>(sizes[i]), place));
      place += static_cast<std::ptrdiff_t>(sizes[i]);
    }
  }
}

TEST_P(TensorKernelsOf, EnlargesByRepeating) {
  const std::vector<std::uint8_t> in = random_bytes(3 * 5 * 12);
  std::vector<std::uint8_t> out(4 * in.size());
  kernels().upsample2x(in.data(), 3, 5, 12, out.data());
  for (std::size_t y = 0; y < 6; ++y) {
    for (std::size_t x = 0; x < 10; ++x) {
      for (std::size_t b = 0; b < 12; ++b) {
        ASSERT_EQ(out[(y * 10 + x) * 12 + b], in[(y / 2 * 5 + x / 2) * 12 + b]);
      }
    }
  }
}

TEST_P(TensorKernelsOf, AddsFloatsAndBytes) {
  const std::vector<float> a = random_floats(77);
  const std::vector<float> b = random_floats(77);
  std::vector<float> sum(77);
  kernels().add(a.data(), b.data(), sum.size(), sum.data());
  for (std::size_t i = 0; i < sum.size(); ++i) {
    ASSERT_EQ(sum[i], a[i] + b[i]);
  }
  const std::vector<std::uint8_t> c = random_bytes(77);
  const std::vector<std::uint8_t> d = random_bytes(77);
  std::vector<std::uint8_t> bytes(77);
  kernels().add_u8(c.data(), {0.01F, 10}, d.data(), {0.03F, 120}, bytes.size(), {0.02F, 60}, bytes.data());
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const float real = 0.01F * static_cast<float>(c[i] - 10) + 0.03F * static_cast<float>(d[i] - 120);
    ASSERT_NEAR(bytes[i], rounded(real / 0.02F + 60), 1);
  }
}

TEST_P(TensorKernelsOf, QuantizesToTheNearestStep) {
  const Quantization quantization{0.02F, 90};
  const std::vector<float> values = random_floats(101);
  std::vector<std::uint8_t> bytes(values.size());
  std::vector<float> again(values.size());
  kernels().quantize(values.data(), values.size(), quantization, bytes.data());
  kernels().dequantize(bytes.data(), bytes.size(), quantization, again.data());
  for (std::size_t i = 0; i < values.size(); ++i) {
    ASSERT_NEAR(again[i], std::clamp(values[i], -90 * 0.02F, 165 * 0.02F), 0.01F + 1e-5F);
  }
  const float zero = 0;
  kernels().quantize(&zero, 1, quantization, bytes.data());
  EXPECT_EQ(bytes[0], 90) << "zero is exact";
}

TEST_P(TensorKernelsOf, TakesStatisticsOfChannels) {
  constexpr std::size_t kChannels = 13;
  constexpr std::size_t kPixels = 21;
  const std::vector<float> in = random_floats(kChannels * kPixels);
  std::vector<float> sums(kChannels);
  std::vector<float> maxima(kChannels);
  kernels().channel_statistics(in.data(), kPixels, kChannels, sums.data(), maxima.data());
  for (std::size_t c = 0; c < kChannels; ++c) {
    float sum = 0;
    float maximum = in[c];
    for (std::size_t p = 0; p < kPixels; ++p) {
      sum += in[p * kChannels + c];
      maximum = std::max(maximum, in[p * kChannels + c]);
    }
    EXPECT_NEAR(sums[c], sum, 1e-4F);
    EXPECT_EQ(maxima[c], maximum);
  }
}

TEST_P(TensorKernelsOf, GatesChannelsAndPixels) {
  for (const std::size_t channels : {std::size_t{3}, std::size_t{8}, std::size_t{29}}) {
    constexpr std::size_t kPixels = 9;
    const std::vector<float> in = random_floats(channels * kPixels);
    const std::vector<float> gates = random_floats(channels);
    std::vector<float> out(in.size());
    std::vector<float> means(kPixels);
    std::vector<float> maxima(kPixels);
    kernels().gate_channels(in.data(), gates.data(), kPixels, channels, out.data(), means.data(), maxima.data());
    for (std::size_t p = 0; p < kPixels; ++p) {
      float sum = 0;
      float maximum = in[p * channels] * gates[0];
      for (std::size_t c = 0; c < channels; ++c) {
        const float value = in[p * channels + c] * gates[c];
        ASSERT_EQ(out[p * channels + c], value);
        sum += value;
        maximum = std::max(maximum, value);
      }
      EXPECT_NEAR(means[p], sum / static_cast<float>(channels), 1e-5F);
      EXPECT_EQ(maxima[p], maximum);
    }
    const std::vector<float> before = out;
    const std::vector<float> pixel_gates = random_floats(kPixels);
    kernels().gate_pixels(out.data(), pixel_gates.data(), kPixels, channels);
    for (std::size_t i = 0; i < out.size(); ++i) {
      ASSERT_EQ(out[i], before[i] * pixel_gates[i / channels]);
    }
  }
}

TEST_P(TensorKernelsOf, SigmoidIsExactEnoughEverywhere) {
  std::vector<float> values;
  for (float x = -30; x < 30; x += 0.0137F) {
    values.push_back(x);
  }
  values.insert(values.end(), {-1e30F, -100, -0.0F, 100, 1e30F});
  std::vector<float> result = values;
  kernels().sigmoid(result.data(), result.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double expected = 1 / (1 + std::exp(-static_cast<double>(values[i])));
    ASSERT_NEAR(result[i], expected, 1e-6 * expected + 1e-37) << values[i];
  }
}

TEST_P(TensorKernelsOf, WhatIsNoNumberBecomesSomeNumber) {
  std::vector<float> values(9, std::numeric_limits<float>::quiet_NaN());
  std::vector<std::uint8_t> bytes(values.size());
  kernels().quantize(values.data(), values.size(), {0.1F, 20}, bytes.data());
  EXPECT_EQ(bytes, std::vector<std::uint8_t>(9, 255));
  kernels().sigmoid(values.data(), values.size());
  for (const float value : values) {
    EXPECT_GE(value, 0);
    EXPECT_LE(value, 1);
  }
}

TEST_P(TensorKernelsOf, CorrelatesTwoPlanes) {
  constexpr std::size_t kKernel = 5;
  constexpr std::size_t kWidth = 19;
  constexpr std::size_t kStride = kWidth + kKernel - 1;
  const std::vector<float> means = random_floats(kStride * kKernel);
  const std::vector<float> maxima = random_floats(kStride * kKernel);
  const std::vector<float> weights = random_floats(2 * kKernel * kKernel);
  std::vector<float> out(kWidth);
  kernels().correlate_row(means.data(), maxima.data(), kStride, weights.data(), kKernel, 0.5F, kWidth, out.data());
  for (std::size_t x = 0; x < kWidth; ++x) {
    float expected = 0.5F;
    for (std::size_t i = 0; i < kKernel; ++i) {
      for (std::size_t j = 0; j < kKernel; ++j) {
        expected += weights[i * kKernel + j] * means[i * kStride + x + j];
        expected += weights[(kKernel + i) * kKernel + j] * maxima[i * kStride + x + j];
      }
    }
    EXPECT_NEAR(out[x], expected, 1e-4F);
  }
}

}  // namespace
}  // namespace posed
