#include "slam/orb_pattern.h"

#include <cmath>
#include <cstdlib>
#include <numbers>

namespace posed {

// Learnt by learn_orb_pattern.cpp from 120 frames, every second of the first 240, of the recording freiburg1_xyz of the TUM RGB-D
// benchmark (CC BY 4.0).
const std::array<BriefTest, kBriefTests> kBriefPattern = {{
#include "slam/orb_pattern_table.inc"
}};

RotatedPattern::RotatedPattern(std::ptrdiff_t stride) {
  offsets_.reserve(static_cast<std::size_t>(kOrientations * kBriefTests * 2));
  for (int orientation = 0; orientation < kOrientations; ++orientation) {
    // Of these angles only the multiples of 45 degrees have rational sines or ratios of them, and none puts a coordinate half way
    // between two integers; so rounding does not depend on the last bit of the library's sine.
    const double angle_rad = 2.0 * std::numbers::pi * orientation / kOrientations;
    const double cosine = std::cos(angle_rad);
    const double sine = std::sin(angle_rad);
    const auto offset = [&](int x, int y) {
      const long turned_x = std::lround(cosine * x - sine * y);
      const long turned_y = std::lround(sine * x + cosine * y);
      return static_cast<std::int16_t>(turned_y * stride + turned_x);
    };
    for (const BriefTest& test : kBriefPattern) {
      offsets_.push_back(offset(test.ax, test.ay));
      offsets_.push_back(offset(test.bx, test.by));
    }
  }
}

const std::int16_t* RotatedPattern::offsets(float angle_rad) const {
  constexpr float kPerRadian = kOrientations / (2.0f * std::numbers::pi_v<float>);
  const int orientation = static_cast<int>(angle_rad * kPerRadian + kOrientations + 0.5f) % kOrientations;
  return offsets_.data() + static_cast<std::ptrdiff_t>(orientation) * kBriefTests * 2;
}

float orientation_rad(int x, int y) {
  if (x == 0 && y == 0) {
    return 0.0f;
  }
  constexpr float kPi = std::numbers::pi_v<float>;
  const auto width = static_cast<float>(std::abs(x));
  const auto height = static_cast<float>(std::abs(y));
  const bool steep = height > width;
  const float t = steep ? width / height : height / width;
  // Abramowitz and Stegun, Handbook of Mathematical Functions, 4.4.49.
  const float t2 = t * t;
  float angle = t * (0.9998660f + t2 * (-0.3302995f + t2 * (0.1801410f + t2 * (-0.0851330f + t2 * 0.0208351f))));
  angle = steep ? 0.5f * kPi - angle : angle;
  angle = x < 0 ? kPi - angle : angle;
  return y < 0 ? -angle : angle;
}

}  // namespace posed
