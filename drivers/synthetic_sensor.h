#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/image_view.h"
#include "drivers/synthetic_texture.h"

namespace posed {

/// What a structured-light RGB-D camera makes of a perfect picture. Every random number is a hash of (seed, frame, pixel), so a
/// frame is the same whenever and in whatever order it is made. Immutable, so thread-safe.
class SyntheticSensor {
 public:
  static constexpr float kMinDepth_m = 0.4F;
  static constexpr float kMaxDepth_m = 6.0F;
  /// Step of the inverse depth [1/m]: an eighth of a pixel of disparity at 43.5 pixel metres (580 pixels, 75 mm baseline), as of
  /// the first Kinect. Source: Khoshelham, Elberink, "Accuracy and resolution of Kinect depth data", Sensors 12(2), 2012.
  static constexpr float kInverseDepthStep = 1.0F / (8.0F * 43.5F);
  static constexpr float kColourSigma = 1.5F;     ///< grey levels, each channel
  static constexpr float kGainAmplitude = 0.05F;  ///< of the slow exposure control
  static constexpr float kRowGainAmplitude = 0.012F;

  explicit SyntheticSensor(std::uint32_t seed);

  /// Standard deviation [m] of the depth at z metres: 0.0012 + 0.0019 (z - 0.4)^2, the axial noise of Nguyen, Izadi, Lovell,
  /// "Modeling Kinect sensor noise for improved 3D reconstruction and tracking", 3DIMPVT 2012, eq. 1. Quantisation comes on top.
  static constexpr float depth_sigma_m(float z) { return 0.0012F + 0.0019F * (z - 0.4F) * (z - 0.4F); }

  /// Noise, quantisation, range limits (0 outside) and holes beside depth steps. Equal sizes; the two must not overlap.
  void measure_depth(std::uint64_t frame, ImageView<const float> clean, ImageView<float> measured) const;

  /// Exposure that drifts slowly and runs over the rows (rolling exposure), and noise; writes colour and its grey (BT.601 weights).
  void measure_colour(std::uint64_t frame, double t_s, ImageView<const PackedBgr> clean, ImageView<std::uint8_t> bgr,
                      ImageView<std::uint8_t> gray) const;

  /// The same conversion without exposure and noise.
  static void copy_colour(ImageView<const PackedBgr> clean, ImageView<std::uint8_t> bgr, ImageView<std::uint8_t> gray);

  /// Gain of row `row` of `rows` at `t_s`.
  float gain(double t_s, int row, int rows) const;

 private:
  static constexpr std::size_t kQuantiles = 1024;

  std::uint32_t seed_;
  std::array<float, kQuantiles> normal_{};              ///< quantiles of the standard normal distribution, scaled to unit variance
  std::array<std::int8_t, kQuantiles> colour_noise_{};  ///< sixteenths of a grey level
};

}  // namespace posed
