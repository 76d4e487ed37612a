#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace posed {

/// 256-bit rotated BRIEF descriptor, in four words so that a distance is four popcounts.
using Descriptor = std::array<std::uint64_t, 4>;

/// A FAST corner of the image pyramid.
struct Keypoint {
  float x = 0;  ///< pixels of the full image (level 0), as seen, lens distortion included
  float y = 0;
  float angle_rad = 0;        ///< orientation by the intensity centroid, (-pi, pi]
  std::uint8_t level = 0;     ///< pyramid level it was found on
  std::uint8_t response = 0;  ///< FAST score [grey levels]: the largest threshold at which it is still a corner
};

/// Keypoints of one image with their descriptors, index by index. The vectors keep their capacity from frame to frame.
struct Features {
  std::vector<Keypoint> keypoints;
  std::vector<Descriptor> descriptors;

  void reserve(std::size_t capacity) {
    keypoints.reserve(capacity);
    descriptors.reserve(capacity);
  }
};

/// Room to reserve for the features of a frame, so that no vector grows while tracking: the extractor may give a few more than
/// asked for.
constexpr std::size_t feature_capacity(int nominal_features) {
  return 2 * static_cast<std::size_t>(nominal_features);
}

}  // namespace posed
