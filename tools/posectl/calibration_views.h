#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "core/image_view.h"
#include "core/pinhole_camera.h"
#include "core/se3.h"

/// Views of a chessboard and what can be judged of them without a camera model. Pixels: whole numbers at pixel centres.
namespace posed {

/// A chessboard, by its inner corners.
struct Board {
  int columns = 8;
  int rows = 6;
  double square_m = 0.025;

  /// Corner `i` in the board's own frame [m], row by row, z = 0; the order of BoardView::corners.
  Eigen::Vector3d corner(std::size_t i) const {
    const auto n = static_cast<std::size_t>(columns);
    return {static_cast<double>(i % n) * square_m, static_cast<double>(i / n) * square_m, 0.0};
  }
  std::size_t corners() const { return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows); }
};

struct BoardView {
  std::vector<Eigen::Vector2d> corners;  ///< [pixels] as seen, lens distortion included
  double edge_width_px = 0;              ///< over which an edge of the board goes from black to white; blur makes it wide
};

/// Chooses views that are sharp and differ from each other, and keeps count of where in the image corners were. Thread-bound.
class ViewSelector {
 public:
  ViewSelector(int width, int height) : width_(width), height_(height) {}

  /// Takes the view where it is sharp and its corners lie elsewhere than those of every view before; false where it is not taken.
  bool offer(const BoardView& view);

  const std::vector<BoardView>& views() const { return views_; }

  /// Share of the image's 8 x 6 fields that held a corner, 0 to 1.
  double coverage() const;

 private:
  static constexpr int kColumns = 8;
  static constexpr int kRows = 6;

  int width_;
  int height_;
  std::vector<BoardView> views_;
  std::array<bool, static_cast<std::size_t>(kColumns) * kRows> seen_{};
};

/// Depth of one point of the board: where the pose puts it, and as the depth camera has it. Both [m] along z.
struct BoardDepth {
  double expected_m = 0;
  double measured_m = 0;
};

/// How measured depth follows from the expected one: measured = scale * expected + offset.
struct DepthFit {
  std::size_t points = 0;
  double scale = 1;
  double offset_m = 0;  ///< 0 where the views' distances are too much alike to tell it from the scale
  bool has_offset = false;
  double rms_m = 0;  ///< of what the fit leaves
};

/// Adds the points between the corners of a board that lies at `T_camera_board` and has depth.
void sample_board_depth(const Board& board, const Se3& T_camera_board, const PinholeCamera& camera, ImageView<const float> depth_m,
                        std::vector<BoardDepth>& points);

/// Least squares; a point that is off by more than 10 % is no point of the board, and left out. Fewer than 100 points give no fit
/// (`points` says how many).
DepthFit fit_depth(const std::vector<BoardDepth>& points);

}  // namespace posed
