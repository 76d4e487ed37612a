#include "slam/depth_grid.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace posed {

namespace {

constexpr int kStep = 2;                                                           // [pixels] between samples
constexpr int kSamples = (DepthGrid::kCell / kStep) * (DepthGrid::kCell / kStep);  // a cell
constexpr int kLeastSamples = kSamples / 4;

int cells_along(int pixels) {
  return (pixels + DepthGrid::kCell - 1) / DepthGrid::kCell;
}

float lower_quartile(std::array<float, kSamples>& samples, int count) {
  const auto first = samples.begin();
  std::nth_element(first, first + count / 4, first + count);
  return samples[static_cast<std::size_t>(count / 4)];
}

}  // namespace

DepthGrid::DepthGrid(int image_width, int image_height) : columns_(cells_along(image_width)), rows_(cells_along(image_height)) {
  depth_m_.assign(static_cast<std::size_t>(columns_ * rows_), 0.0F);
}

void DepthGrid::assign(ImageView<const float> depth_m) {
  std::array<float, kSamples> samples;
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      int count = 0;
      for (int y = row * kCell; y < std::min((row + 1) * kCell, depth_m.height); y += kStep) {
        const float* const line = depth_m.row(y);
        for (int x = column * kCell; x < std::min((column + 1) * kCell, depth_m.width); x += kStep) {
          if (std::isfinite(line[x]) && line[x] > 0) {
            samples[static_cast<std::size_t>(count++)] = line[x];
          }
        }
      }
      depth_m_[cell(column, row)] = count < kLeastSamples ? 0.0F : lower_quartile(samples, count);
    }
  }
}

GridCamera::GridCamera(const PinholeCamera& camera)
    : camera_(camera),
      columns_(cells_along(camera.intrinsics().width)),
      rows_(cells_along(camera.intrinsics().height)),
      bounds_(camera.undistorted_bounds().cast<float>()) {
  rays_.reserve(static_cast<std::size_t>(columns_ * rows_));
  const double middle = 0.5 * (DepthGrid::kCell - 1);
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      const Eigen::Vector2d seen(column * DepthGrid::kCell + middle, row * DepthGrid::kCell + middle);
      rays_.push_back(camera_.unproject(camera_.undistort(seen), 1.0).head<2>().cast<float>());
    }
  }
}

int GridCamera::cell_of(const Eigen::Vector3f& p_camera) const {
  constexpr float kNearest_m = 0.05F;
  if (p_camera.z() < kNearest_m) {
    return kOutside;
  }
  const Eigen::Vector2d ideal = camera_.project(p_camera.cast<double>());
  if (!(ideal.x() >= bounds_[0] && ideal.y() >= bounds_[1] && ideal.x() < bounds_[2] && ideal.y() < bounds_[3])) {
    return kOutside;
  }
  const Eigen::Vector2d seen = camera_.is_distorted() ? camera_.distort(ideal) : ideal;
  const int column = static_cast<int>(std::floor((seen.x() + 0.5) / DepthGrid::kCell));
  const int row = static_cast<int>(std::floor((seen.y() + 0.5) / DepthGrid::kCell));
  return column >= 0 && row >= 0 && column < columns_ && row < rows_ ? row * columns_ + column : kOutside;
}

}  // namespace posed
