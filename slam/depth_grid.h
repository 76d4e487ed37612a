#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/image_view.h"
#include "core/pinhole_camera.h"

namespace posed {

/// A depth image at one value for each cell of kCell x kCell pixels: fine enough for people, small enough to be gone through many
/// times a frame. Cells are numbered row by row. Allocates at construction only. Reentrant.
class DepthGrid {
 public:
  static constexpr int kCell = 8;  ///< [pixels]

  DepthGrid(int image_width, int image_height);

  /// Each cell gets the lower quartile of its valid samples, so that at an edge what is in front wins over what the sensor makes
  /// up between front and back; 0 where fewer than a quarter of the samples are valid.
  void assign(ImageView<const float> depth_m);

  int columns() const { return columns_; }
  int rows() const { return rows_; }
  std::size_t size() const { return depth_m_.size(); }
  float operator[](std::size_t cell) const { return depth_m_[cell]; }
  std::size_t cell(int column, int row) const { return static_cast<std::size_t>(row * columns_ + column); }

  /// Calls `visit(neighbour)` for the up to eight cells around `cell`.
  template <typename Visit>
  void for_each_around(std::size_t cell, Visit&& visit) const {
    const int column = static_cast<int>(cell) % columns_;
    const int row = static_cast<int>(cell) / columns_;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const int x = column + dx;
        const int y = row + dy;
        if ((dx != 0 || dy != 0) && x >= 0 && y >= 0 && x < columns_ && y < rows_) {
          visit(this->cell(x, y));
        }
      }
    }
  }

  /// The same for the up to four cells that share a side with it.
  template <typename Visit>
  void for_each_beside(std::size_t cell, Visit&& visit) const {
    const int column = static_cast<int>(cell) % columns_;
    const int row = static_cast<int>(cell) / columns_;
    const auto stride = static_cast<std::size_t>(columns_);
    if (row > 0)
      visit(cell - stride);
    if (column > 0)
      visit(cell - 1);
    if (column + 1 < columns_)
      visit(cell + 1);
    if (row + 1 < rows_)
      visit(cell + stride);
  }

 private:
  int columns_;
  int rows_;
  std::vector<float> depth_m_;
};

/// Where the cells of a camera's depth grid look, and which cell a point falls into. Lens distortion is in it. Immutable.
class GridCamera {
 public:
  static constexpr int kOutside = -1;

  explicit GridCamera(const PinholeCamera& camera);

  /// The centre of a cell at `depth_m` [m along z], in the camera frame.
  Eigen::Vector3f point(std::size_t cell, float depth_m) const {
    return {rays_[cell].x() * depth_m, rays_[cell].y() * depth_m, depth_m};
  }

  /// The cell that sees a point of the camera frame, or kOutside.
  int cell_of(const Eigen::Vector3f& p_camera) const;

 private:
  PinholeCamera camera_;
  int columns_;
  int rows_;
  Eigen::Vector4f bounds_;             // of the undistorted image: beyond it the distortion means nothing
  std::vector<Eigen::Vector2f> rays_;  // x / z and y / z of each cell's centre
};

}  // namespace posed
