#include "tools/posectl/calibration_views.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

namespace posed {
namespace {

constexpr double kWidestEdge_px = 4.0;
constexpr double kSmallestMove = 0.05;  // of the image's width, mean over the corners
constexpr std::size_t kFewestPoints = 100;
constexpr double kOutlier = 0.1;  // of the expected depth
constexpr double kRangeForOffset = 1.25;

/// Mean distance of corners; a board that looks the same upside down may come in either order.
double mean_move(const std::vector<Eigen::Vector2d>& a, const std::vector<Eigen::Vector2d>& b) {
  double forward = 0;
  double backward = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    forward += (a[i] - b[i]).norm();
    backward += (a[i] - b[b.size() - 1 - i]).norm();
  }
  return std::min(forward, backward) / static_cast<double>(a.size());
}

}  // namespace

bool ViewSelector::offer(const BoardView& view) {
  const bool is_new = std::all_of(views_.begin(), views_.end(), [&](const BoardView& before) {
    return mean_move(view.corners, before.corners) >= kSmallestMove * width_;
  });
  if (view.edge_width_px > kWidestEdge_px || !is_new) {
    return false;
  }
  views_.push_back(view);
  for (const Eigen::Vector2d& corner : view.corners) {
    const int column = std::clamp(static_cast<int>(corner.x() * kColumns / width_), 0, kColumns - 1);
    const int row = std::clamp(static_cast<int>(corner.y() * kRows / height_), 0, kRows - 1);
    seen_[static_cast<std::size_t>(row * kColumns + column)] = true;
  }
  return true;
}

double ViewSelector::coverage() const {
  return static_cast<double>(std::count(seen_.begin(), seen_.end(), true)) / static_cast<double>(seen_.size());
}

void sample_board_depth(const Board& board, const Se3& T_camera_board, const PinholeCamera& camera, ImageView<const float> depth_m,
                        std::vector<BoardDepth>& points) {
  constexpr int kPerSquare = 4;
  for (int row = 0; row <= (board.rows - 1) * kPerSquare; ++row) {
    for (int column = 0; column <= (board.columns - 1) * kPerSquare; ++column) {
      const Eigen::Vector3d p_board(column * board.square_m / kPerSquare, row * board.square_m / kPerSquare, 0.0);
      const Eigen::Vector3d p_camera = T_camera_board * p_board;
      if (p_camera.z() <= 0) {
        continue;
      }
      const Eigen::Vector2d pixel = camera.distort(camera.project(p_camera));
      const auto x = static_cast<int>(std::lround(pixel.x()));
      const auto y = static_cast<int>(std::lround(pixel.y()));
      if (x < 0 || y < 0 || x >= depth_m.width || y >= depth_m.height || depth_m.at(x, y) <= 0) {
        continue;
      }
      points.push_back({p_camera.z(), static_cast<double>(depth_m.at(x, y))});
    }
  }
}

DepthFit fit_depth(const std::vector<BoardDepth>& points) {
  std::vector<BoardDepth> used;
  std::copy_if(points.begin(), points.end(), std::back_inserter(used),
               [](const BoardDepth& p) { return std::abs(p.measured_m - p.expected_m) <= kOutlier * p.expected_m; });
  DepthFit fit;
  fit.points = used.size();
  if (used.size() < kFewestPoints) {
    return fit;
  }
  const auto [nearest, farthest] = std::minmax_element(
      used.begin(), used.end(), [](const BoardDepth& a, const BoardDepth& b) { return a.expected_m < b.expected_m; });
  fit.has_offset = farthest->expected_m > kRangeForOffset * nearest->expected_m;
  Eigen::Matrix2d A = Eigen::Matrix2d::Zero();
  Eigen::Vector2d b = Eigen::Vector2d::Zero();
  for (const BoardDepth& p : used) {
    const Eigen::Vector2d row(p.expected_m, fit.has_offset ? 1.0 : 0.0);
    A += row * row.transpose();
    b += row * p.measured_m;
  }
  if (!fit.has_offset) {
    A(1, 1) = 1.0;
  }
  const Eigen::Vector2d solution = A.ldlt().solve(b);
  fit.scale = solution.x();
  fit.offset_m = solution.y();
  double squares = 0;
  for (const BoardDepth& p : used) {
    squares += std::pow(p.measured_m - fit.scale * p.expected_m - fit.offset_m, 2);
  }
  fit.rms_m = std::sqrt(squares / static_cast<double>(used.size()));
  return fit;
}

}  // namespace posed
