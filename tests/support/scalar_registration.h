#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/image_view.h"
#include "core/pinhole_camera.h"
#include "core/se3.h"

namespace posed::test {

/// What drivers/depth_registration.h computes, one pixel after the other, in the same order of operations: its results are the same
/// to the last bit, and its time is what SIMD is measured against.
class ScalarRegistration {
 public:
  ScalarRegistration(const CameraIntrinsics& depth, const CameraIntrinsics& color, const Se3& T_camera_depth,
                     const Eigen::Vector2f& half_patch)
      : color_(color),
        t_(T_camera_depth.translation().cast<float>()),
        half_patch_(half_patch),
        metres_per_unit_(static_cast<float>(1.0 / depth.depth_units_per_metre)) {
    const PinholeCamera lens(depth);
    for (int y = 0; y < depth.height; ++y) {
      for (int x = 0; x < depth.width; ++x) {
        const Eigen::Vector3d ray = T_camera_depth.rotation_matrix() * lens.unproject(lens.undistort({x, y}), 1.0);
        rays_.push_back((ray / depth.depth_units_per_metre).cast<float>());
      }
    }
    const PinholeCamera color_lens(color);
    distorted_ = color_lens.is_distorted();
    const Eigen::Vector4d bounds = color_lens.undistorted_bounds();
    min_x_ = static_cast<float>((bounds[0] - 1.0 - color.cx) / color.fx);
    min_y_ = static_cast<float>((bounds[1] - 1.0 - color.cy) / color.fy);
    max_x_ = static_cast<float>((bounds[2] + 1.0 - color.cx) / color.fx);
    max_y_ = static_cast<float>((bounds[3] + 1.0 - color.cy) / color.fy);
  }

  void apply(ImageView<const std::uint16_t> raw, ImageView<float> depth_m) const {
    for (int y = 0; y < depth_m.height; ++y) {
      std::fill_n(depth_m.row(y), depth_m.width, 0.0F);
    }
    std::size_t i = 0;
    for (int y = 0; y < raw.height; ++y) {
      for (int x = 0; x < raw.width; ++x) {
        move(static_cast<float>(raw.at(x, y)), rays_[i++], depth_m);
      }
    }
  }

 private:
  void move(float units, const Eigen::Vector3f& ray, ImageView<float> depth_m) const {
    const float z = units * ray.z() + t_.z();
    if (units == 0.0F || !(z > 0.01F)) {
      return;
    }
    const float inverse_z = 1.0F / z;
    float x = (units * ray.x() + t_.x()) * inverse_z;
    float y = (units * ray.y() + t_.y()) * inverse_z;
    if (!(x >= min_x_ && x <= max_x_ && y >= min_y_ && y <= max_y_)) {
      return;
    }
    if (distorted_) {
      const auto coefficient = [](double value) { return static_cast<float>(value); };
      const float k1 = coefficient(color_.k1), k2 = coefficient(color_.k2), k3 = coefficient(color_.k3);
      const float p1 = coefficient(color_.p1), p2 = coefficient(color_.p2);
      const float xx = x * x, yy = y * y, xy2 = (x + x) * y, r2 = xx + yy;
      const float radial = 1.0F + r2 * (k1 + r2 * (k2 + r2 * k3));
      x = x * radial + p1 * xy2 + p2 * (r2 + (xx + xx));
      y = y * radial + p1 * (r2 + (yy + yy)) + p2 * xy2;
    }
    const float u = x * static_cast<float>(color_.fx) + static_cast<float>(color_.cx);
    const float v = y * static_cast<float>(color_.fy) + static_cast<float>(color_.cy);
    const float growth = units * metres_per_unit_ * inverse_z;
    const float half_x = std::min(growth * half_patch_.x(), 8.0F);
    const float half_y = std::min(growth * half_patch_.y(), 8.0F);
    const int right = std::min(static_cast<int>(std::floor(u + half_x)), depth_m.width - 1);
    const int bottom = std::min(static_cast<int>(std::floor(v + half_y)), depth_m.height - 1);
    for (int row = std::max(static_cast<int>(std::ceil(v - half_y)), 0); row <= bottom; ++row) {
      for (int column = std::max(static_cast<int>(std::ceil(u - half_x)), 0); column <= right; ++column) {
        float& there = depth_m.at(column, row);
        there = there == 0.0F || z < there ? z : there;
      }
    }
  }

  CameraIntrinsics color_;
  Eigen::Vector3f t_;
  Eigen::Vector2f half_patch_;
  float metres_per_unit_;
  std::vector<Eigen::Vector3f> rays_;
  bool distorted_ = false;
  float min_x_ = 0, min_y_ = 0, max_x_ = 0, max_y_ = 0;
};

}  // namespace posed::test
