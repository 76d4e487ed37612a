#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <vector>

namespace posed {

/// A colour, 8 bits a channel: blue | green << 8 | red << 16.
using PackedBgr = std::uint32_t;

/// log2(x) for x > 0, continuous and monotonic, at most 0.09 too small (the mantissa is taken as linear): enough to choose a level.
inline float coarse_log2(float x) {
  return static_cast<float>(std::bit_cast<std::int32_t>(x) - 0x3f800000) * 0x1p-23F;
}

/// An image with its pyramid of half-sized, box-filtered levels, so that a sample averages over the pixel's footprint and the
/// picture does not shimmer when the camera moves. Source: Williams, "Pyramidal parametrics", SIGGRAPH 1983. Immutable, so
/// thread-safe.
class MipTexture {
 public:
  static constexpr int kLevels = 6;
  static constexpr int kGranularity = 1 << (kLevels - 1);  ///< both sides are a multiple of it, so that every level halves exactly

  /// `texels` are rows of `width` texels that cover width_m x height_m metres.
  MipTexture(float width_m, float height_m, int width, int height, std::vector<PackedBgr> texels);

  float width_m() const { return width_m_; }
  float height_m() const { return height_m_; }
  float texels_per_m_u() const { return static_cast<float>(levels_[0].width) / width_m_; }
  float texels_per_m_v() const { return static_cast<float>(levels_[0].height) / height_m_; }

  /// Sample at (u, v), in texels of level 0 (0 is the outer edge of the first texel); bilinear within a level and blended between
  /// two; outside, the border goes on. `footprint` is the side of the pixel on the texture, in texels of level 0.
  PackedBgr sample(float u, float v, float footprint) const {
    const float level = std::clamp(coarse_log2(footprint), 0.0F, static_cast<float>(kLevels - 1));
    const int lower = static_cast<int>(level);
    // Near a level one sample serves: the blend between two levels takes the middle half of the way.
    const float blend = std::clamp(2.0F * (level - static_cast<float>(lower)) - 0.5F, 0.0F, 1.0F);
    if (blend == 1.0F) {
      return joined(bilinear(levels_[static_cast<std::size_t>(lower) + 1], u, v));
    }
    const auto weight = static_cast<std::uint64_t>(blend * 256.0F);
    std::uint64_t colour = bilinear(levels_[static_cast<std::size_t>(lower)], u, v);
    if (weight != 0) {
      colour = lerp(colour, bilinear(levels_[static_cast<std::size_t>(lower) + 1], u, v), weight);
    }
    return joined(colour);
  }

 private:
  struct Level {
    std::size_t offset;
    int width;
    int height;
    float scale;  ///< 256 fixed-point steps a texel, over 2^level
  };

  /// Channels in 16-bit lanes: 0 and 2 in the low half, 1 in the high half.
  static std::uint64_t spread(PackedBgr c) {
    return (c & 0x00ff00ffU) | (static_cast<std::uint64_t>((c >> 8) & 0x00ff00ffU) << 32);
  }
  static PackedBgr joined(std::uint64_t lanes) { return static_cast<PackedBgr>(lanes | (lanes >> 24)); }
  static std::uint64_t lerp(std::uint64_t a, std::uint64_t b, std::uint64_t weight_b) {
    constexpr std::uint64_t kHalf = 0x0080008000800080U;
    return ((a * (256 - weight_b) + b * weight_b + kHalf) >> 8) & 0x00ff00ff00ff00ffU;
  }

  std::uint64_t bilinear(const Level& level, float u, float v) const {
    const int fixed_u = static_cast<int>(u * level.scale) - 128;
    const int fixed_v = static_cast<int>(v * level.scale) - 128;
    const int u0 = std::clamp(fixed_u >> 8, 0, level.width - 1);
    const int v0 = std::clamp(fixed_v >> 8, 0, level.height - 1);
    const int u1 = std::clamp((fixed_u >> 8) + 1, 0, level.width - 1);
    const int v1 = std::clamp((fixed_v >> 8) + 1, 0, level.height - 1);
    const auto weight_u = static_cast<std::uint64_t>(fixed_u & 255);
    const auto weight_v = static_cast<std::uint64_t>(fixed_v & 255);
    const PackedBgr* texels = texels_.data() + level.offset;
    const PackedBgr* top = texels + static_cast<std::ptrdiff_t>(v0) * level.width;
    const PackedBgr* bottom = texels + static_cast<std::ptrdiff_t>(v1) * level.width;
    return lerp(lerp(spread(top[u0]), spread(top[u1]), weight_u), lerp(spread(bottom[u0]), spread(bottom[u1]), weight_u), weight_v);
  }

  float width_m_;
  float height_m_;
  std::array<Level, kLevels> levels_{};
  std::vector<PackedBgr> texels_;  ///< all levels, one after the other
};

}  // namespace posed
