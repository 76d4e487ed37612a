#pragma once

#include <Eigen/Core>

namespace posed {

/// Intrinsics of an RGB-D camera whose depth is registered to colour.
struct CameraIntrinsics {
  int width = 640;    ///< pixels
  int height = 480;   ///< pixels
  double fx = 525.0;  ///< focal lengths [pixels]
  double fy = 525.0;
  double cx = 319.5;  ///< principal point [pixels]; pixel centres have whole-numbered coordinates
  double cy = 239.5;
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;  ///< radial-tangential distortion (Brown-Conrady, as in OpenCV)
  double depth_units_per_metre = 5000.0;          ///< raw 16-bit depth / this = metres
  double depth_delay_s = 0;                       ///< [s] added to RgbdFrame::depth_offset_ns: what the images' stamps do not tell
  double baseline_fx = 40.0;  ///< [pixel metres] baseline times fx: the virtual stereo coordinate is u_r = u - baseline_fx / z
};

/// Pinhole camera with radial-tangential distortion. Camera frame: x right, y down, z forward. Immutable, so thread-safe.
class PinholeCamera {
 public:
  explicit PinholeCamera(const CameraIntrinsics& intrinsics);

  const CameraIntrinsics& intrinsics() const { return k_; }
  bool is_distorted() const { return distorted_; }

  /// Point in the camera frame [m], z > 0, to the ideal (undistorted) pixel.
  Eigen::Vector2d project(const Eigen::Vector3d& p_camera) const {
    return {k_.fx * p_camera.x() / p_camera.z() + k_.cx, k_.fy * p_camera.y() / p_camera.z() + k_.cy};
  }

  /// Ideal pixel and depth along z [m] to the point in the camera frame [m].
  Eigen::Vector3d unproject(const Eigen::Vector2d& ideal_pixel, double depth_m) const {
    return {(ideal_pixel.x() - k_.cx) / k_.fx * depth_m, (ideal_pixel.y() - k_.cy) / k_.fy * depth_m, depth_m};
  }

  /// Ideal pixel to the pixel where the lens puts it.
  Eigen::Vector2d distort(const Eigen::Vector2d& ideal_pixel) const;

  /// Pixel as seen to the ideal pixel: inverse of `distort` to 1e-6 pixels within the image, by Newton's method, for a
  /// calibration that is one-to-one there (a polynomial fitted well beyond its data may fold back; then the result means nothing).
  Eigen::Vector2d undistort(const Eigen::Vector2d& seen_pixel) const;

  /// Smallest axis-aligned box of ideal pixels that holds the whole undistorted image: (min x, min y, max x, max y).
  Eigen::Vector4d undistorted_bounds() const;

 private:
  CameraIntrinsics k_;
  bool distorted_ = false;
};

}  // namespace posed
