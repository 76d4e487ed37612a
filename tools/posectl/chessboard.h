#pragma once

#include <array>
#include <optional>
#include <vector>

#include "core/image_view.h"
#include "core/pinhole_camera.h"
#include "core/result.h"
#include "core/se3.h"
#include "tools/posectl/calibration_views.h"

/// Chessboards by OpenCV's calib3d, which stands behind this header alone. Only in builds with it (POSED_HAS_CALIB3D). Reentrant.
/// No exception leaves these functions.
namespace posed {

/// All corners of the board, or nothing where they are not all seen.
std::optional<BoardView> find_board(ImageView<const std::uint8_t> gray, const Board& board);

struct Calibration {
  CameraIntrinsics camera;
  std::array<double, 9> deviations{};  ///< standard deviations of fx, fy, cx, cy [pixels], k1, k2, p1, p2, k3; 0: not estimated
  double rms_px = 0;                   ///< reprojection error over all corners of all views
  std::vector<double> view_rms_px;
  std::vector<Se3> T_camera_board;  ///< a view
};

/// Estimates the intrinsics from the views. Of `start` size, depth units and baseline are kept (baseline_fx follows fx); k3 is
/// estimated where `with_k3`, else 0. Error InvalidArgument: fewer than 5 views, or views that do not determine a camera.
Result<Calibration> calibrate_camera(const std::vector<BoardView>& views, const Board& board, const CameraIntrinsics& start,
                                     bool with_k3);

/// The same figures for intrinsics that stay as they are: only the board's poses are estimated. Error InvalidArgument: no views, or
/// one whose pose cannot be found.
Result<Calibration> check_camera(const std::vector<BoardView>& views, const Board& board, const CameraIntrinsics& camera);

}  // namespace posed
