#include "drivers/synthetic_sensor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "drivers/synthetic_hash.h"

namespace posed {

namespace {

constexpr double kTurn = 2 * std::numbers::pi;

enum class Stream : std::uint32_t { Depth = 1, Colour = 2 };

std::uint32_t frame_key(std::uint32_t seed, std::uint64_t frame, Stream stream) {
  const std::uint32_t low = hash32(seed, static_cast<std::uint32_t>(frame), static_cast<std::uint32_t>(frame >> 32));
  return hash32(low, static_cast<std::uint32_t>(stream));
}

/// The q-quantile of the standard normal distribution, by bisection on its distribution function: run once, so it may be slow.
double normal_quantile(double q) {
  double low = -6;
  double high = 6;
  for (int i = 0; i < 40; ++i) {
    const double middle = (low + high) / 2;
    (0.5 * std::erfc(-middle / std::numbers::sqrt2) < q ? low : high) = middle;
  }
  return (low + high) / 2;
}

/// A step in depth between neighbours that no surface seen at a sensible slant explains.
bool is_step(float z, float neighbour) {
  return std::abs(z - neighbour) > 0.03F + 0.02F * z;
}

std::uint8_t grey_of(std::uint32_t b, std::uint32_t g, std::uint32_t r) {
  return static_cast<std::uint8_t>((29 * b + 150 * g + 77 * r + 128) >> 8);
}

}  // namespace

SyntheticSensor::SyntheticSensor(std::uint32_t seed) : seed_(hash32(seed, 0x5e5042U)) {
  double square_sum = 0;
  for (std::size_t i = 0; i < kQuantiles; ++i) {
    const double quantile = normal_quantile((static_cast<double>(i) + 0.5) / kQuantiles);
    normal_[i] = static_cast<float>(quantile);
    square_sum += quantile * quantile;
  }
  const auto scale = static_cast<float>(1.0 / std::sqrt(square_sum / kQuantiles));
  for (std::size_t i = 0; i < kQuantiles; ++i) {
    normal_[i] *= scale;
    colour_noise_[i] = static_cast<std::int8_t>(std::clamp(std::lround(normal_[i] * kColourSigma * 16.0F), -127L, 127L));
  }
}

float SyntheticSensor::gain(double t_s, int row, int rows) const {
  const double phase = kTurn * static_cast<double>(seed_ >> 8) * 0x1p-24;
  const double slow = std::sin(kTurn * 0.07 * t_s + phase);
  const double rolling = std::sin(kTurn * (0.31 * t_s + static_cast<double>(row) / rows));
  return 1.0F + kGainAmplitude * static_cast<float>(slow) + kRowGainAmplitude * static_cast<float>(rolling);
}

void SyntheticSensor::measure_depth(std::uint64_t frame, ImageView<const float> clean, ImageView<float> measured) const {
  const std::uint32_t key = frame_key(seed_, frame, Stream::Depth);
  for (int y = 0; y < clean.height; ++y) {
    const float* row = clean.row(y);
    const float* above = clean.row(std::max(y - 1, 0));
    const float* below = clean.row(std::min(y + 1, clean.height - 1));
    float* out = measured.row(y);
    for (int x = 0; x < clean.width; ++x) {
      const float z = row[x];
      const std::uint32_t random = hash32(key + static_cast<std::uint32_t>(y * clean.width + x));
      const bool at_step = is_step(z, row[std::max(x - 1, 0)]) || is_step(z, row[std::min(x + 1, clean.width - 1)]) ||
                           is_step(z, above[x]) || is_step(z, below[x]);
      const bool lost = at_step && (random & 3U) != 0;  // three of four: the pattern is torn there
      const float noisy = z + depth_sigma_m(z) * normal_[random >> 22];
      const float steps = std::floor(1.0F / (std::max(noisy, 0.1F) * kInverseDepthStep) + 0.5F);
      const bool in_range = z > 0 && noisy >= kMinDepth_m && noisy <= kMaxDepth_m;
      out[x] = lost || !in_range ? 0.0F : 1.0F / (steps * kInverseDepthStep);
    }
  }
}

void SyntheticSensor::measure_colour(std::uint64_t frame, double t_s, ImageView<const PackedBgr> clean, ImageView<std::uint8_t> bgr,
                                     ImageView<std::uint8_t> gray) const {
  const std::uint32_t key = frame_key(seed_, frame, Stream::Colour);
  for (int y = 0; y < clean.height; ++y) {
    // Twelve bits after the point: four for the noise table, eight for the gain.
    const auto gain_q8 = static_cast<std::int32_t>(std::lround(gain(t_s, y, clean.height) * 256.0F));
    const PackedBgr* in = clean.row(y);
    std::uint8_t* colour = bgr.row(y);
    std::uint8_t* grey = gray.row(y);
    for (int x = 0; x < clean.width; ++x) {
      const std::uint32_t random = hash32(key + static_cast<std::uint32_t>(y * clean.width + x));
      const auto expose = [&](std::uint32_t shift, std::uint32_t noise) {
        const auto value = static_cast<std::int32_t>(in[x] >> shift & 255U);
        const std::int32_t exposed = value * gain_q8 + 16 * colour_noise_[noise & (kQuantiles - 1)] + 128;
        return static_cast<std::uint32_t>(std::clamp(exposed >> 8, 0, 255));
      };
      const std::uint32_t b = expose(0, random);
      const std::uint32_t g = expose(8, random >> 10);
      const std::uint32_t r = expose(16, random >> 20);
      colour[3 * x] = static_cast<std::uint8_t>(b);
      colour[3 * x + 1] = static_cast<std::uint8_t>(g);
      colour[3 * x + 2] = static_cast<std::uint8_t>(r);
      grey[x] = grey_of(b, g, r);
    }
  }
}

void SyntheticSensor::copy_colour(ImageView<const PackedBgr> clean, ImageView<std::uint8_t> bgr, ImageView<std::uint8_t> gray) {
  for (int y = 0; y < clean.height; ++y) {
    const PackedBgr* in = clean.row(y);
    for (int x = 0; x < clean.width; ++x) {
      const std::uint32_t b = in[x] & 255U;
      const std::uint32_t g = in[x] >> 8 & 255U;
      const std::uint32_t r = in[x] >> 16 & 255U;
      bgr.at(x, y) = static_cast<std::uint8_t>(b);
      bgr.row(y)[3 * x + 1] = static_cast<std::uint8_t>(g);
      bgr.row(y)[3 * x + 2] = static_cast<std::uint8_t>(r);
      gray.at(x, y) = grey_of(b, g, r);
    }
  }
}

}  // namespace posed
