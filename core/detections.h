#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/clock.h"

namespace posed {

/// An upright rectangle in a colour image. [pixels] as seen (lens distortion included); pixel centres have whole-numbered
/// coordinates, so a box of the whole image goes from -0.5 to width - 0.5.
struct BoundingBox {
  float x_min = 0;
  float y_min = 0;
  float x_max = 0;
  float y_max = 0;

  float area() const { return std::max(0.0F, x_max - x_min) * std::max(0.0F, y_max - y_min); }
  friend bool operator==(const BoundingBox&, const BoundingBox&) = default;
};

/// Area of the intersection over that of the union; 0 where both are empty. Reentrant.
inline float intersection_over_union(const BoundingBox& a, const BoundingBox& b) {
  const BoundingBox both{std::max(a.x_min, b.x_min), std::max(a.y_min, b.y_min), std::min(a.x_max, b.x_max),
                         std::min(a.y_max, b.y_max)};
  const float joint = both.area();
  const float all = a.area() + b.area() - joint;
  return all > 0 ? joint / all : 0.0F;
}

struct Detection {
  BoundingBox box;
  float score = 0;  ///< confidence, 0 to 1
  friend bool operator==(const Detection&, const Detection&) = default;
};

/// The people seen in one frame, most confident first. Plain data of fixed size, so it crosses threads by value.
struct Detections {
  static constexpr std::size_t kCapacity = 64;

  std::uint64_t sequence = 0;     ///< of the frame
  TimeNs capture_ns = 0;          ///< of the frame
  std::int64_t stamp_utc_ns = 0;  ///< of the frame
  std::int32_t image_width = 0;   ///< [pixels] 0: no frame was looked at yet
  std::int32_t image_height = 0;  ///< [pixels]
  TimeNs detect_ns = 0;           ///< time spent on it
  std::uint32_t model = 0;        ///< index of the model that looked, in the order of the configuration
  std::uint32_t count = 0;
  std::array<Detection, kCapacity> people{};

  std::span<const Detection> found() const { return {people.data(), count}; }

  /// Keeps those of at least that confidence.
  void drop_below(float score) {
    const auto end = people.begin() + count;
    count = static_cast<std::uint32_t>(std::find_if(people.begin(), end, [&](const Detection& d) { return d.score < score; }) -
                                       people.begin());
  }

  /// Keeps what there is room for.
  void assign(std::span<const Detection> most_confident_first) {
    count = static_cast<std::uint32_t>(std::min(most_confident_first.size(), kCapacity));
    std::copy_n(most_confident_first.begin(), count, people.begin());
  }
};

}  // namespace posed
