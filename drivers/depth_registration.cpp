#include "drivers/depth_registration.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstring>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#include <opencv2/core/hal/intrin.hpp>
#pragma GCC diagnostic pop

namespace posed {

namespace {

using cv::v_float32;
using cv::v_int32;
using cv::v_uint32;

constexpr std::size_t kBlock = 64;  // pixels projected at a time: whole vectors on every machine

/// Neighbours on a slanted wall lie further apart in the other camera than on one that faces it: patches overlap so that it has no
/// seams. An edge moves outwards by an eighth of a pixel.
constexpr double kOverlap = 1.25;

constexpr float kNearest_m = 0.01F;        // nearer points are behind the colour camera, or inside it
constexpr float kLargestHalfPatch = 8.0F;  // pixels; of something that almost touches the colour camera

/// The nearer of what is there, where 0 is nothing, and `z` > 0: positive numbers order as their bits do, and 0 - 1 is the largest.
/// Written without a choice, so that no processor guesses it wrong.
float nearer(float there, float z) {
  return std::bit_cast<float>(std::min(std::bit_cast<std::uint32_t>(there) - 1U, std::bit_cast<std::uint32_t>(z) - 1U) + 1U);
}

}  // namespace

/// Where the pixels of a block fall: whole columns and rows, both ends included, inside the image. `z` is 0 where there is nothing.
struct DepthRegistration::Patches {
  alignas(64) std::int32_t left[kBlock];
  alignas(64) std::int32_t right[kBlock];
  alignas(64) std::int32_t top[kBlock];
  alignas(64) std::int32_t bottom[kBlock];
  alignas(64) float z[kBlock];

  void paint(ImageView<float> depth_m) const {
    for (std::size_t i = 0; i < kBlock; ++i) {
      const std::int32_t columns = right[i] - left[i];
      const std::int32_t rows = bottom[i] - top[i];
      if (z[i] == 0.0F || columns < 0 || rows < 0) {
        continue;
      }
      if (columns <= 1 && rows <= 1) {
        // Four corners that may coincide: cheaper than loops whose ends no processor can foresee.
        write(z[i], depth_m.row(top[i]), left[i], right[i]);
        write(z[i], depth_m.row(bottom[i]), left[i], right[i]);
        continue;
      }
      for (std::int32_t y = top[i]; y <= bottom[i]; ++y) {
        for (std::int32_t x = left[i]; x <= right[i]; x += 2) {
          write(z[i], depth_m.row(y), x, std::min(x + 1, right[i]));
        }
      }
    }
  }

 private:
  static void write(float z, float* row, std::int32_t a, std::int32_t b) {
    row[a] = nearer(row[a], z);
    row[b] = nearer(row[b], z);
  }
};

DepthRegistration::DepthRegistration(const CameraIntrinsics& depth, const CameraIntrinsics& color, const Se3& T_camera_depth)
    : width_(depth.width),
      height_(depth.height),
      row_((static_cast<std::size_t>(depth.width) + kBlock - 1) / kBlock * kBlock),
      color_width_(color.width),
      color_height_(color.height),
      metres_per_unit_(static_cast<float>(1.0 / depth.depth_units_per_metre)),
      t_(T_camera_depth.translation().cast<float>()) {
  const PinholeCamera color_camera(color);
  const Eigen::Vector4d bounds = color_camera.undistorted_bounds();
  const auto to_float = [](double value) { return static_cast<float>(value); };
  lens_ = {to_float(color.fx),
           to_float(color.fy),
           to_float(color.cx),
           to_float(color.cy),
           to_float(color.k1),
           to_float(color.k2),
           to_float(color.p1),
           to_float(color.p2),
           to_float(color.k3),
           color_camera.is_distorted(),
           to_float((bounds[0] - 1.0 - color.cx) / color.fx),
           to_float((bounds[1] - 1.0 - color.cy) / color.fy),
           to_float((bounds[2] + 1.0 - color.cx) / color.fx),
           to_float((bounds[3] + 1.0 - color.cy) / color.fy)};

  const PinholeCamera depth_camera(depth);
  const Eigen::Matrix3d R_camera_depth = T_camera_depth.rotation_matrix();
  for (std::vector<float>* rays : {&ray_x_, &ray_y_, &ray_z_}) {
    rays->resize(row_ * static_cast<std::size_t>(height_));
  }
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const Eigen::Vector3d ray = R_camera_depth * depth_camera.unproject(depth_camera.undistort({x, y}), 1.0);
      const std::size_t at = static_cast<std::size_t>(y) * row_ + static_cast<std::size_t>(x);
      ray_x_[at] = to_float(ray.x() / depth.depth_units_per_metre);
      ray_y_[at] = to_float(ray.y() / depth.depth_units_per_metre);
      ray_z_[at] = to_float(ray.z() / depth.depth_units_per_metre);
    }
  }
  measure_patches(depth_camera, color_camera, T_camera_depth);
}

/// The largest box that a depth pixel far away takes in the colour image: lenses magnify unevenly.
void DepthRegistration::measure_patches(const PinholeCamera& depth, const PinholeCamera& color, const Se3& T_camera_depth) {
  constexpr int kStep = 8;
  const Eigen::Vector4d bounds = color.undistorted_bounds();
  const auto seen = [&](int x, int y, Eigen::Vector2d& pixel) {
    const Eigen::Vector3d ray = T_camera_depth.rotation() * depth.unproject(depth.undistort({x, y}), 1.0);
    if (ray.z() <= 0) {
      return false;
    }
    const Eigen::Vector2d ideal = color.project(ray);
    pixel = color.distort(ideal);
    return ideal.x() >= bounds[0] && ideal.y() >= bounds[1] && ideal.x() <= bounds[2] && ideal.y() <= bounds[3];
  };
  double width = 0;
  double height = 0;
  for (int y = 0; y + 1 < height_; y += kStep) {
    for (int x = 0; x + 1 < width_; x += kStep) {
      Eigen::Vector2d here;
      Eigen::Vector2d right;
      Eigen::Vector2d below;
      if (seen(x, y, here) && seen(x + 1, y, right) && seen(x, y + 1, below)) {
        width = std::max(width, std::abs(right.x() - here.x()) + std::abs(below.x() - here.x()));
        height = std::max(height, std::abs(right.y() - here.y()) + std::abs(below.y() - here.y()));
      }
    }
  }
  half_patch_x_ = static_cast<float>(0.5 * kOverlap * width);
  half_patch_y_ = static_cast<float>(0.5 * kOverlap * height);
}

template <bool kDistorted>
void DepthRegistration::project(const std::uint16_t* raw, std::size_t first, Patches& patches) const {
  const auto all = [](float value) { return cv::vx_setall_f32(value); };
  const v_float32 one = all(1.0F);
  const v_float32 zero = all(0.0F);
  for (std::size_t i = 0; i < kBlock; i += v_float32::nlanes) {
    const v_float32 units = cv::v_cvt_f32(cv::v_reinterpret_as_s32(cv::vx_load_expand(raw + i)));
    const v_float32 pz = units * cv::vx_load(&ray_z_[first + i]) + all(t_.z());
    v_float32 valid = (units > zero) & (pz > all(kNearest_m));
    const v_float32 inverse_z = one / cv::v_select(valid, pz, one);
    const v_float32 x = (units * cv::vx_load(&ray_x_[first + i]) + all(t_.x())) * inverse_z;
    const v_float32 y = (units * cv::vx_load(&ray_y_[first + i]) + all(t_.y())) * inverse_z;
    valid = valid & (x >= all(lens_.min_x)) & (x <= all(lens_.max_x)) & (y >= all(lens_.min_y)) & (y <= all(lens_.max_y));
    v_float32 seen_x = x;
    v_float32 seen_y = y;
    if constexpr (kDistorted) {
      const v_float32 xx = x * x;
      const v_float32 yy = y * y;
      const v_float32 xy2 = (x + x) * y;
      const v_float32 r2 = xx + yy;
      const v_float32 radial = one + r2 * (all(lens_.k1) + r2 * (all(lens_.k2) + r2 * all(lens_.k3)));
      seen_x = x * radial + all(lens_.p1) * xy2 + all(lens_.p2) * (r2 + (xx + xx));
      seen_y = y * radial + all(lens_.p1) * (r2 + (yy + yy)) + all(lens_.p2) * xy2;
    }
    const v_float32 u = cv::v_select(valid, seen_x * all(lens_.fx) + all(lens_.cx), zero);
    const v_float32 v = cv::v_select(valid, seen_y * all(lens_.fy) + all(lens_.cy), zero);
    // What is nearer to the colour camera than to the depth camera looks larger there.
    const v_float32 growth = units * all(metres_per_unit_) * inverse_z;
    const v_float32 half_x = cv::v_min(growth * all(half_patch_x_), all(kLargestHalfPatch));
    const v_float32 half_y = cv::v_min(growth * all(half_patch_y_), all(kLargestHalfPatch));
    cv::v_store_aligned(patches.left + i, cv::v_max(cv::v_ceil(u - half_x), cv::vx_setzero_s32()));
    cv::v_store_aligned(patches.right + i, cv::v_min(cv::v_floor(u + half_x), cv::vx_setall_s32(color_width_ - 1)));
    cv::v_store_aligned(patches.top + i, cv::v_max(cv::v_ceil(v - half_y), cv::vx_setzero_s32()));
    cv::v_store_aligned(patches.bottom + i, cv::v_min(cv::v_floor(v + half_y), cv::vx_setall_s32(color_height_ - 1)));
    cv::v_store_aligned(patches.z + i, pz & valid);
  }
}

void DepthRegistration::apply(ImageView<const std::uint16_t> raw, ImageView<float> depth_m) const {
  assert(raw.width == width_ && raw.height == height_ && depth_m.width == color_width_ && depth_m.height == color_height_);
  for (int y = 0; y < color_height_; ++y) {
    std::fill_n(depth_m.row(y), color_width_, 0.0F);
  }
  Patches patches;
  const auto width = static_cast<std::size_t>(width_);
  for (int y = 0; y < height_; ++y) {
    for (std::size_t x = 0; x < width; x += kBlock) {
      const std::uint16_t* block = raw.row(y) + x;
      std::uint16_t last[kBlock] = {};  // a row's end, with nothing behind it
      if (width - x < kBlock) {
        std::copy_n(block, width - x, last);
        block = last;
      }
      const std::size_t first = static_cast<std::size_t>(y) * row_ + x;
      if (lens_.distorted) {
        project<true>(block, first, patches);
      } else {
        project<false>(block, first, patches);
      }
      patches.paint(depth_m);
    }
  }
}

}  // namespace posed
