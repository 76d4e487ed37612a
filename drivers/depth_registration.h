#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/image_view.h"
#include "core/pinhole_camera.h"
#include "core/se3.h"

namespace posed {

/// Brings the depth of one camera into the image of another, as if the colour camera had measured it. Each depth pixel is moved as
/// a patch of the size that it has in the colour image, so that a colour image of more pixels gets no holes; the nearest wins.
/// Both lenses may be distorted. Immutable, so thread-safe. Holds 12 bytes a depth pixel.
class DepthRegistration {
 public:
  /// `T_camera_depth` maps depth camera coordinates to colour camera coordinates. `depth.depth_units_per_metre` is that of the raw
  /// depth; the sizes are those of the images.
  DepthRegistration(const CameraIntrinsics& depth, const CameraIntrinsics& color, const Se3& T_camera_depth);

  /// Raw depth (0 is invalid) to metres along the colour camera's z axis, in the colour image as its lens shows it; 0 where the
  /// depth camera saw nothing. Every pixel of `depth_m` is written. The views have the sizes of the two images.
  void apply(ImageView<const std::uint16_t> raw, ImageView<float> depth_m) const;

  /// Half the size of a depth pixel in the colour image [pixels], where it is equally far from both cameras.
  Eigen::Vector2f half_patch() const { return {half_patch_x_, half_patch_y_}; }

 private:
  /// The colour camera at z = 1 [metres], in single precision.
  struct Lens {
    float fx = 0, fy = 0, cx = 0, cy = 0;
    float k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
    bool distorted = false;
    float min_x = 0, min_y = 0, max_x = 0, max_y = 0;  // what it sees; beyond, the formula of distortion may fold back
  };
  struct Patches;

  void measure_patches(const PinholeCamera& depth, const PinholeCamera& color, const Se3& T_camera_depth);
  template <bool kDistorted>
  void project(const std::uint16_t* raw, std::size_t first, Patches& patches) const;

  int width_;  // of the depth image
  int height_;
  std::size_t row_;  // width_ in whole blocks
  int color_width_;
  int color_height_;
  Lens lens_;
  float metres_per_unit_;
  float half_patch_x_ = 0;  // pixels of the colour image, for a pixel that is equally far from both cameras
  float half_patch_y_ = 0;
  Eigen::Vector3f t_;                         // of T_camera_depth
  std::vector<float> ray_x_, ray_y_, ray_z_;  // what a raw depth of 1 means for each pixel, in the colour camera's axes [m]
};

}  // namespace posed
