#include "tools/posectl/chessboard.h"

#include <algorithm>
#include <cmath>
#include <exception>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace posed {
namespace {

constexpr std::size_t kFewestViews = 5;

std::vector<cv::Point3f> object_points(const Board& board) {
  std::vector<cv::Point3f> points;
  for (std::size_t i = 0; i < board.corners(); ++i) {
    const Eigen::Vector3f p = board.corner(i).cast<float>();
    points.emplace_back(p.x(), p.y(), p.z());
  }
  return points;
}

std::vector<cv::Point2f> image_points(const BoardView& view) {
  std::vector<cv::Point2f> points;
  for (const Eigen::Vector2d& corner : view.corners) {
    points.emplace_back(static_cast<float>(corner.x()), static_cast<float>(corner.y()));
  }
  return points;
}

/// Small squares are found some tenths of a pixel off; where the grey values' gradient says that a corner is, is several times as
/// good. The window must hold one corner alone.
void refine(const cv::Mat& image, std::vector<cv::Point2f>& corners) {
  double spacing_px = cv::norm(corners[1] - corners[0]);
  for (std::size_t i = 2; i < corners.size(); ++i) {
    spacing_px = std::min(spacing_px, cv::norm(corners[i] - corners[i - 1]));
  }
  const int half_window = std::clamp(static_cast<int>(spacing_px / 3), 2, 8);
  cv::cornerSubPix(image, corners, {half_window, half_window}, {-1, -1},
                   {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 40, 0.001});
}

Se3 pose_of(const cv::Mat& rotation_vector, const cv::Mat& translation) {
  const Eigen::Vector3d r(rotation_vector.at<double>(0), rotation_vector.at<double>(1), rotation_vector.at<double>(2));
  const double angle = r.norm();
  const Eigen::Quaterniond q(Eigen::AngleAxisd(angle, angle > 0 ? Eigen::Vector3d(r / angle) : Eigen::Vector3d::UnitX()));
  return Se3(q, {translation.at<double>(0), translation.at<double>(1), translation.at<double>(2)});
}

/// Reprojection errors, by our own camera model: what is reported is then true of the program that will use the file.
void measure(const std::vector<BoardView>& views, const Board& board, Calibration& calibration) {
  const PinholeCamera camera(calibration.camera);
  double squares = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    double view_squares = 0;
    for (std::size_t i = 0; i < board.corners(); ++i) {
      const Eigen::Vector2d seen = camera.distort(camera.project(calibration.T_camera_board[v] * board.corner(i)));
      view_squares += (seen - views[v].corners[i]).squaredNorm();
    }
    calibration.view_rms_px.push_back(std::sqrt(view_squares / static_cast<double>(board.corners())));
    squares += view_squares;
  }
  calibration.rms_px = std::sqrt(squares / static_cast<double>(views.size() * board.corners()));
}

tl::unexpected<Error> failed(const char* what, const std::exception& exception) {
  return make_error(ErrorCode::InvalidArgument, fmt::format("{}: {}", what, exception.what()));
}

}  // namespace

std::optional<BoardView> find_board(ImageView<const std::uint8_t> gray, const Board& board) try {
  // OpenCV has no image that cannot be written to; nothing here writes.
  const cv::Mat image(gray.height, gray.width, CV_8UC1, const_cast<std::uint8_t*>(gray.data),
                      static_cast<std::size_t>(gray.stride));
  const cv::Size size(board.columns, board.rows);
  std::vector<cv::Point2f> corners;
  if (!cv::findChessboardCornersSB(image, size, corners, cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_ACCURACY)) {
    return std::nullopt;
  }
  refine(image, corners);
  BoardView view;
  for (const cv::Point2f& corner : corners) {
    view.corners.emplace_back(corner.x, corner.y);
  }
  view.edge_width_px = cv::estimateChessboardSharpness(image, size, corners)[0];
  return view;
} catch (const std::exception&) {
  return std::nullopt;  // an image in which it cannot even be looked for
}

Result<Calibration> calibrate_camera(const std::vector<BoardView>& views, const Board& board, const CameraIntrinsics& start,
                                     bool with_k3) try {
  if (views.size() < kFewestViews) {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("{} usable views of the board, and at least {} are needed; show it at "
                                  "other places, distances and tilts",
                                  views.size(), kFewestViews));
  }
  std::vector<std::vector<cv::Point2f>> seen;
  std::transform(views.begin(), views.end(), std::back_inserter(seen), image_points);
  const std::vector<std::vector<cv::Point3f>> objects(views.size(), object_points(board));
  cv::Mat matrix;
  cv::Mat distortion;
  std::vector<cv::Mat> rotations;
  std::vector<cv::Mat> translations;
  cv::Mat deviations;
  cv::calibrateCamera(objects, seen, cv::Size(start.width, start.height), matrix, distortion, rotations, translations, deviations,
                      cv::noArray(), cv::noArray(), with_k3 ? 0 : cv::CALIB_FIX_K3);
  Calibration calibration;
  CameraIntrinsics& k = calibration.camera;
  k = start;
  k.fx = matrix.at<double>(0, 0);
  k.fy = matrix.at<double>(1, 1);
  k.cx = matrix.at<double>(0, 2);
  k.cy = matrix.at<double>(1, 2);
  k.k1 = distortion.at<double>(0);
  k.k2 = distortion.at<double>(1);
  k.p1 = distortion.at<double>(2);
  k.p2 = distortion.at<double>(3);
  k.k3 = distortion.at<double>(4);
  k.baseline_fx = start.baseline_fx * k.fx / start.fx;
  for (int i = 0; i < 9; ++i) {
    calibration.deviations[static_cast<std::size_t>(i)] = deviations.at<double>(i);
  }
  std::transform(rotations.begin(), rotations.end(), translations.begin(), std::back_inserter(calibration.T_camera_board), pose_of);
  measure(views, board, calibration);
  return calibration;
} catch (const std::exception& exception) {
  return failed("these views do not determine a camera", exception);
}

Result<Calibration> check_camera(const std::vector<BoardView>& views, const Board& board, const CameraIntrinsics& camera) try {
  if (views.empty()) {
    return make_error(ErrorCode::InvalidArgument, "the board was not found in any image");
  }
  const cv::Mat matrix = (cv::Mat_<double>(3, 3) << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
  const cv::Mat distortion = (cv::Mat_<double>(5, 1) << camera.k1, camera.k2, camera.p1, camera.p2, camera.k3);
  Calibration calibration;
  calibration.camera = camera;
  for (const BoardView& view : views) {
    cv::Mat rotation;
    cv::Mat translation;
    if (!cv::solvePnP(object_points(board), image_points(view), matrix, distortion, rotation, translation)) {
      return make_error(ErrorCode::InvalidArgument, "the pose of a board cannot be found with this calibration");
    }
    calibration.T_camera_board.push_back(pose_of(rotation, translation));
  }
  measure(views, board, calibration);
  return calibration;
} catch (const std::exception& exception) {
  return failed("the board's poses cannot be found", exception);
}

}  // namespace posed
