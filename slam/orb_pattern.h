#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace posed {

/// One test of the descriptor: is pixel a darker than pixel b? Coordinates from the keypoint, x right and y down, within
/// kPatchRadius.
struct BriefTest {
  std::int8_t ax, ay, bx, by;
};

constexpr int kBriefTests = 256;

/// The tests for a keypoint of orientation 0; orb_pattern.cpp says where they come from.
extern const std::array<BriefTest, kBriefTests> kBriefPattern;

/// The pattern turned to each of a number of orientations, as pixel offsets for one row stride. Reentrant.
class RotatedPattern {
 public:
  /// 5.6 degrees apart. Of 2,961 correct matches between frames of a recording, half as many orientations lose 121 and twice as
  /// many (a table of 128 KiB) gain 47.
  static constexpr int kOrientations = 64;

  explicit RotatedPattern(std::ptrdiff_t stride);

  /// Offsets of a and b of each test, one after the other, for the orientation nearest to `angle_rad` in [-pi, pi].
  const std::int16_t* offsets(float angle_rad) const;

 private:
  std::vector<std::int16_t> offsets_;
};

/// Angle of the vector (x, y) in (-pi, pi], 0 for the null vector; to 2e-5 rad. Plain arithmetic of fixed order, so that unlike
/// std::atan2 it is the same number on every machine.
float orientation_rad(int x, int y);

}  // namespace posed
