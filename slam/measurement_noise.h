#pragma once

#include <vector>

#include "config/config.h"
#include "core/pinhole_camera.h"

namespace posed {

/// How far a keypoint's measurements can be trusted. Pixel coordinates: one grey-level pixel of the pyramid level the corner was
/// found on. Disparity: the depth sensor's own noise (Nguyen, Izadi, Lovell, "Modeling Kinect sensor noise for improved 3D
/// reconstruction and tracking", 3DIMPVT 2012, eq. 3), and what the pixel error does to the depth that is looked up on a slanted
/// surface. Immutable.
class MeasurementNoise {
 public:
  MeasurementNoise(const TrackerConfig& config, const CameraIntrinsics& camera) : baseline_fx_(camera.baseline_fx) {
    double scale = 1.0;
    for (int level = 0; level < config.pyramid_levels; ++level) {
      pixel_variance_.push_back(scale * scale * kPixelSigma * kPixelSigma);
      scale *= config.pyramid_scale;
    }
  }

  /// 1 / variance of each pixel coordinate [1 / pixels^2].
  double pixel_weight(int level) const { return 1.0 / pixel_variance_[static_cast<std::size_t>(level)]; }

  /// 1 / variance of the disparity baseline_fx / depth [1 / pixels^2].
  double disparity_weight(int level, double depth_m) const {
    const double sensor_sigma_m = 0.0012 + 0.0019 * (depth_m - 0.4) * (depth_m - 0.4);
    const double sensor_sigma = baseline_fx_ / (depth_m * depth_m) * sensor_sigma_m;
    return 1.0 / (sensor_sigma * sensor_sigma + kLookupShare * pixel_variance_[static_cast<std::size_t>(level)]);
  }

 private:
  static constexpr double kPixelSigma = 1.0;
  // Of the pixel variance: 0.2 pixels of disparity a pixel. A surface at 1 m that is seen at 45 degrees moves 0.08; the rest is for
  // steeper ones and for edges.
  static constexpr double kLookupShare = 0.04;
  double baseline_fx_;
  std::vector<double> pixel_variance_;
};

}  // namespace posed
