#include "drivers/synthetic_sensor.h"

#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

namespace posed {
namespace {

constexpr int kWidth = 200;
constexpr int kHeight = 160;

template <typename T>
struct Image {
  explicit Image(T value, int channels = 1)
      : pixels(static_cast<std::size_t>(kWidth * kHeight * channels), value), count(channels) {}
  ImageView<T> view() { return {pixels.data(), kWidth, kHeight, kWidth * count, count}; }

  std::vector<T> pixels;
  int count;
};

struct Statistics {
  double mean = 0;
  double variance = 0;
};

template <typename T>
Statistics statistics_of(const std::vector<T>& values) {
  Statistics s;
  for (const T v : values) {
    s.mean += static_cast<double>(v) / static_cast<double>(values.size());
  }
  for (const T v : values) {
    s.variance += (static_cast<double>(v) - s.mean) * (static_cast<double>(v) - s.mean) / static_cast<double>(values.size());
  }
  return s;
}

TEST(SyntheticSensor, DepthNoiseFollowsTheModel) {
  const SyntheticSensor sensor(7);
  for (const float z : {0.8F, 1.5F, 3.0F, 4.5F}) {
    Image<float> clean(z);
    Image<float> measured(0.0F);
    sensor.measure_depth(11, clean.view(), measured.view());
    const Statistics s = statistics_of(measured.pixels);
    const double step = static_cast<double>(SyntheticSensor::kInverseDepthStep * z * z);
    const double sigma = static_cast<double>(SyntheticSensor::depth_sigma_m(z));
    const double expected = sigma * sigma + step * step / 12;  // noise, and rounding to steps
    // At short range the noise is a fraction of a step, so rounding is not independent of it: a wide margin there.
    const double margin = sigma > 0.5 * step ? 0.08 : 0.6;
    EXPECT_NEAR(s.variance, expected, margin * expected) << "at " << z << " m";
    EXPECT_NEAR(s.mean, static_cast<double>(z), 0.5 * step + 1e-4) << "at " << z << " m";
  }
}

TEST(SyntheticSensor, DepthComesInStepsOfDisparity) {
  const SyntheticSensor sensor(7);
  Image<float> clean(2.0F);
  Image<float> measured(0.0F);
  sensor.measure_depth(3, clean.view(), measured.view());
  for (const float z : measured.pixels) {
    const float steps = 1.0F / (z * SyntheticSensor::kInverseDepthStep);
    ASSERT_NEAR(steps, std::round(steps), 1e-3F);
  }
}

TEST(SyntheticSensor, NothingOutsideOfItsRange) {
  const SyntheticSensor sensor(7);
  for (const float z : {0.0F, 0.3F, 6.5F}) {
    Image<float> clean(z);
    Image<float> measured(1.0F);
    sensor.measure_depth(0, clean.view(), measured.view());
    EXPECT_EQ(statistics_of(measured.pixels).mean, 0.0) << "at " << z << " m";
    EXPECT_EQ(statistics_of(measured.pixels).variance, 0.0) << "at " << z << " m";
  }
}

TEST(SyntheticSensor, HolesLieAlongDepthStepsOnly) {
  const SyntheticSensor sensor(7);
  Image<float> clean(3.0F);
  for (int y = 0; y < kHeight; ++y) {
    std::fill_n(clean.view().row(y), kWidth / 2, 1.5F);
  }
  Image<float> measured(0.0F);
  sensor.measure_depth(0, clean.view(), measured.view());
  int torn = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const bool beside_step = x == kWidth / 2 - 1 || x == kWidth / 2;
      const bool hole = measured.view().at(x, y) == 0.0F;
      ASSERT_TRUE(beside_step || !hole) << x << ", " << y;
      torn += hole ? 1 : 0;
    }
  }
  EXPECT_NEAR(torn, 0.75 * 2 * kHeight, 0.1 * 2 * kHeight);
}

TEST(SyntheticSensor, ColourNoiseAndRollingGain) {
  const SyntheticSensor sensor(7);
  Image<PackedBgr> clean(0x808080U);
  Image<std::uint8_t> bgr(0, 3);
  Image<std::uint8_t> gray(0);
  constexpr double kTime_s = 4.0;
  sensor.measure_colour(5, kTime_s, clean.view(), bgr.view(), gray.view());
  double square = 0;
  for (int y = 0; y < kHeight; ++y) {
    const double expected = 128.0 * static_cast<double>(sensor.gain(kTime_s, y, kHeight));
    for (int i = 0; i < 3 * kWidth; ++i) {
      const double error = bgr.view().row(y)[i] - expected;
      square += error * error / (3.0 * kWidth * kHeight);
    }
  }
  const double sigma = static_cast<double>(SyntheticSensor::kColourSigma);
  EXPECT_NEAR(square, sigma * sigma + 1.0 / 12, 0.15 * sigma * sigma);

  const float top = sensor.gain(kTime_s, 0, kHeight);
  const float middle = sensor.gain(kTime_s, kHeight / 2, kHeight);
  EXPECT_GT(std::abs(top - middle), 1e-4F) << "the exposure does not roll over the rows";
  EXPECT_GT(std::abs(top - sensor.gain(kTime_s + 3.5, 0, kHeight)), 1e-3F) << "the exposure does not drift";
}

TEST(SyntheticSensor, NoiseDependsOnSeedAndFrame) {
  Image<float> clean(2.0F);
  Image<float> first(0.0F);
  Image<float> again(0.0F);
  Image<float> later(0.0F);
  Image<float> other(0.0F);
  SyntheticSensor(7).measure_depth(1, clean.view(), first.view());
  SyntheticSensor(7).measure_depth(1, clean.view(), again.view());
  SyntheticSensor(7).measure_depth(2, clean.view(), later.view());
  SyntheticSensor(8).measure_depth(1, clean.view(), other.view());
  EXPECT_EQ(first.pixels, again.pixels);
  EXPECT_NE(first.pixels, later.pixels);
  EXPECT_NE(first.pixels, other.pixels);
}

}  // namespace
}  // namespace posed
