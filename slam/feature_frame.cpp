#include "slam/feature_frame.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace posed {

namespace {

/// Depth under a keypoint: that of the nearest pixel. A keypoint outside of the image's last half pixel is clamped to it.
float depth_at(ImageView<const float> depth_m, float x, float y) {
  const int column = std::clamp(static_cast<int>(std::lround(x)), 0, depth_m.width - 1);
  const int row = std::clamp(static_cast<int>(std::lround(y)), 0, depth_m.height - 1);
  const float z = depth_m.at(column, row);
  return std::isfinite(z) && z > 0 ? z : 0.0F;
}

constexpr int kFollowSteps = 2;        // what the second one changes is below a depth image's own steps
constexpr float kSameSurface = 0.05F;  // share of the depth by which one surface may change in a step

/// Depth along an ideal pixel's ray when the colour image was taken, from a depth image of another time; `z` is the depth that it
/// has at this pixel. The point there is looked up where the camera saw it in the other image, and moved by what it is off, as a
/// surface across the ray would be.
float follow(const PinholeCamera& camera, ImageView<const float> depth_m, const Eigen::Vector2f& ideal_pixel, float z,
             const Se3& T_depth_color) {
  for (int step = 0; step < kFollowSteps; ++step) {
    const Eigen::Vector3d p = T_depth_color * camera.unproject(ideal_pixel.cast<double>(), z);
    if (p.z() <= 0) {
      return 0.0F;
    }
    const Eigen::Vector2d pixel = camera.distort(camera.project(p));
    const bool in_image =
        pixel.x() > -0.5 && pixel.x() < depth_m.width - 0.5 && pixel.y() > -0.5 && pixel.y() < depth_m.height - 0.5;
    if (!in_image) {
      return 0.0F;
    }
    const float seen = depth_at(depth_m, static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
    const float change = seen - static_cast<float>(p.z());
    if (std::abs(change) > kSameSurface * seen) {
      return 0.0F;
    }
    z += change;
  }
  return z;
}

}  // namespace

FeatureFrame::FeatureFrame(const PinholeCamera& camera, std::size_t capacity) {
  const Eigen::Vector4f bounds = camera.undistorted_bounds().cast<float>();
  min_u_ = bounds[0];
  min_v_ = bounds[1];
  max_u_ = bounds[2];
  max_v_ = bounds[3];
  columns_per_pixel_ = static_cast<float>(kColumns) / (max_u_ - min_u_);
  rows_per_pixel_ = static_cast<float>(kRows) / (max_v_ - min_v_);
  cell_begin_.resize(kColumns * kRows + 1);
  features_.reserve(capacity);
  ideal_pixels_.reserve(capacity);
  depth_m_.reserve(capacity);
  trust_.reserve(capacity);
  disparity_.reserve(capacity);
  cell_keypoints_.reserve(capacity);
  cell_of_.reserve(capacity);
}

int FeatureFrame::column_of(float u) const {
  return std::clamp(static_cast<int>((u - min_u_) * columns_per_pixel_), 0, kColumns - 1);
}

int FeatureFrame::row_of(float v) const {
  return std::clamp(static_cast<int>((v - min_v_) * rows_per_pixel_), 0, kRows - 1);
}

void FeatureFrame::place(const PinholeCamera& camera, ImageView<const float> depth_m, const std::optional<Se3>& T_depth_color) {
  look_up(camera, depth_m, T_depth_color);
  complete(camera);
}

void FeatureFrame::look_up(const PinholeCamera& camera, ImageView<const float> depth_m, const std::optional<Se3>& T_depth_color) {
  trust_.assign(size(), 1.0F);
  ideal_pixels_.resize(size());
  depth_m_.resize(size());
  for (std::size_t i = 0; i < size(); ++i) {
    const Keypoint& k = features_.keypoints[i];
    ideal_pixels_[i] = camera.undistort({k.x, k.y}).cast<float>();
    depth_m_[i] = depth_at(depth_m, k.x, k.y);
    if (T_depth_color && depth_m_[i] > 0) {
      depth_m_[i] = follow(camera, depth_m, ideal_pixels_[i], depth_m_[i], *T_depth_color);
    }
  }
}

void FeatureFrame::shrink(std::size_t count) {
  features_.keypoints.resize(count);
  features_.descriptors.resize(count);
  ideal_pixels_.resize(count);
  depth_m_.resize(count);
  trust_.resize(count);
}

void FeatureFrame::place_stored(const PinholeCamera& camera, const Features& features,
                                const std::vector<Eigen::Vector2f>& ideal_pixels, const std::vector<float>& depth_m) {
  assert(ideal_pixels.size() == features.keypoints.size() && depth_m.size() == features.keypoints.size());
  features_ = features;
  ideal_pixels_ = ideal_pixels;
  depth_m_ = depth_m;
  trust_.assign(size(), 1.0F);
  complete(camera);
}

void FeatureFrame::complete(const PinholeCamera& camera) {
  const std::size_t n = size();
  assert(n <= std::numeric_limits<std::uint16_t>::max());
  disparity_.resize(n);
  cell_of_.resize(n);
  cell_keypoints_.resize(n);
  std::fill(cell_begin_.begin(), cell_begin_.end(), std::uint16_t{0});
  const auto baseline_fx = static_cast<float>(camera.intrinsics().baseline_fx);
  for (std::size_t i = 0; i < n; ++i) {
    disparity_[i] = depth_m_[i] > 0 ? baseline_fx / depth_m_[i] : 0.0F;
    cell_of_[i] = static_cast<std::uint16_t>(row_of(ideal_pixels_[i].y()) * kColumns + column_of(ideal_pixels_[i].x()));
    ++cell_begin_[cell_of_[i] + 1];
  }
  // Counting sort: offsets, then indices; each cell's keypoints stay in ascending order.
  for (std::size_t c = 1; c < cell_begin_.size(); ++c) {
    cell_begin_[c] = static_cast<std::uint16_t>(cell_begin_[c] + cell_begin_[c - 1]);
  }
  for (std::size_t i = n; i-- > 0;) {
    // Filling from the back leaves each end offset at its cell's begin: the table is shifted by one for this.
    const std::uint16_t slot = --cell_begin_[cell_of_[i] + 1];
    cell_keypoints_[slot] = static_cast<std::uint16_t>(i);
  }
  // Now cell_begin_[c + 1] is the begin of cell c; shift back.
  std::copy(cell_begin_.begin() + 1, cell_begin_.end(), cell_begin_.begin());
  cell_begin_.back() = static_cast<std::uint16_t>(n);
}

std::span<const std::uint16_t> FeatureFrame::search(float u, float v, float radius, int min_level, int max_level,
                                                    std::vector<std::uint16_t>& scratch) const {
  scratch.clear();
  if (u + radius < min_u_ || u - radius > max_u_ || v + radius < min_v_ || v - radius > max_v_) {
    return {};
  }
  const int first_column = column_of(u - radius);
  const int last_column = column_of(u + radius);
  const int last_row = row_of(v + radius);
  for (int row = row_of(v - radius); row <= last_row; ++row) {
    const std::size_t first = static_cast<std::size_t>(row * kColumns + first_column);
    const std::size_t last = static_cast<std::size_t>(row * kColumns + last_column);
    // The cells of a row lie one after the other, so a row is one run.
    for (std::size_t j = cell_begin_[first]; j < cell_begin_[last + 1]; ++j) {
      const std::uint16_t i = cell_keypoints_[j];
      const int level = features_.keypoints[i].level;
      if (level >= min_level && level <= max_level && std::abs(ideal_pixels_[i].x() - u) <= radius &&
          std::abs(ideal_pixels_[i].y() - v) <= radius) {
        scratch.push_back(i);
      }
    }
  }
  return scratch;
}

}  // namespace posed
