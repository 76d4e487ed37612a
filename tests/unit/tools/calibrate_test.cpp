#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "config/config_loader.h"
#include "drivers/image_writer.h"
#include "drivers/pixel_conversion.h"
#include "drivers/tum_writer.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_recording.h"
#include "tests/unit/tools/posectl_outcome.h"
#include "tools/posectl/calibration_views.h"
#include "tools/posectl/camera_text.h"
#include "tools/posectl/chessboard.h"
#include "tools/posectl/exit_code.h"

namespace posed {
namespace {

using testing::HasSubstr;

constexpr int kWidth = 400;
constexpr int kHeight = 300;
const Board kBoard{8, 6, 0.03};

CameraIntrinsics true_camera() {
  CameraIntrinsics camera;
  camera.width = kWidth;
  camera.height = kHeight;
  camera.fx = 331.0;
  camera.fy = 328.5;
  camera.cx = 203.0;
  camera.cy = 146.5;
  camera.k1 = -0.12;
  camera.k2 = 0.05;
  camera.p1 = 0.001;
  camera.p2 = -0.0008;
  camera.depth_units_per_metre = 1000.0;
  camera.baseline_fx = 20.0;
  return camera;
}

/// A board in front of the camera: its middle at (x, y, z) [m], turned about the image's axes [rad].
Se3 board_at(double x, double y, double z, double about_x, double about_y) {
  const Eigen::Quaterniond q(Eigen::AngleAxisd(about_x, Eigen::Vector3d::UnitX()) *
                             Eigen::AngleAxisd(about_y, Eigen::Vector3d::UnitY()));
  const Eigen::Vector3d middle(3.5 * kBoard.square_m, 2.5 * kBoard.square_m, 0.0);
  return Se3(q, Eigen::Vector3d(x, y, z) - q * middle);
}

/// Places, distances and tilts as a person would show them.
std::vector<Se3> poses() {
  std::vector<Se3> found;
  int i = 0;
  for (const double y : {-0.09, 0.0, 0.09}) {
    for (const double x : {-0.14, -0.03, 0.06, 0.14}) {
      const double z = 0.5 + 0.07 * (i % 4);
      found.push_back(board_at(x * z / 0.55, y * z / 0.55, z, (i % 3 - 1) * 0.45, (i % 4 - 1.5) * 0.3));
      ++i;
    }
  }
  return found;
}

/// Where the viewing ray of `ideal` meets the board: in the board's frame [m], and its depth.
Eigen::Vector3d meet(const PinholeCamera& camera, const Se3& T_board_camera, const Eigen::Vector2d& ideal, double& depth_m) {
  const Eigen::Vector3d origin = T_board_camera.translation();
  const Eigen::Vector3d direction = T_board_camera.rotation() * camera.unproject(ideal, 1.0);
  depth_m = -origin.z() / direction.z();
  return origin + depth_m * direction;
}

double brightness(const Eigen::Vector3d& p_board) {
  const double column = std::floor(p_board.x() / kBoard.square_m) + 1;
  const double row = std::floor(p_board.y() / kBoard.square_m) + 1;
  const bool is_board = column >= 0 && row >= 0 && column <= kBoard.columns && row <= kBoard.rows;
  return is_board && std::fmod(column + row, 2.0) == 0.0 ? 30.0 : 220.0;
}

/// Draws the board on an endless white wall, into `frame`.
void render(const CameraIntrinsics& intrinsics, const Se3& T_camera_board, RgbdFrame& frame) {
  constexpr int kSamples = 6;       // across
  constexpr double kBlur_px = 2.0;  // of the lens: a box of this width
  const PinholeCamera camera(intrinsics);
  const Se3 T_board_camera = T_camera_board.inverse();
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const Eigen::Vector2d ideal = camera.undistort({x, y});
      double depth_m = 0;
      double sum = 0;
      for (int i = 0; i < kSamples * kSamples; ++i) {
        // The lens bends so little within a pixel that its samples lie as without it.
        const Eigen::Vector2d offset((i % kSamples + 0.5) / kSamples - 0.5, (i / kSamples + 0.5) / kSamples - 0.5);
        sum += brightness(meet(camera, T_board_camera, ideal + kBlur_px * offset, depth_m));
      }
      meet(camera, T_board_camera, ideal, depth_m);
      frame.depth_m.at(x, y) = static_cast<float>(depth_m);
      for (int c = 0; c < 3; ++c) {
        (&frame.bgr.at(x, y))[c] = static_cast<std::uint8_t>(std::lround(sum / (kSamples * kSamples)));
      }
    }
  }
  gray_from_bgr(frame.bgr, frame.gray);
}

/// All poses rendered once for all tests, for that takes its time.
class Rendered {
 public:
  Rendered() : pool_(kWidth, kHeight, poses().size()) {
    for (const Se3& T_camera_board : poses()) {
      frames_.push_back(*pool_.acquire());
      render(true_camera(), T_camera_board, *frames_.back());
    }
  }
  std::vector<FrameWriter>& frames() { return frames_; }

 private:
  FramePool pool_;
  std::vector<FrameWriter> frames_;
};

std::vector<FrameWriter>& frames() {
  static Rendered rendered;
  return rendered.frames();
}

std::vector<BoardView> views() {
  std::vector<BoardView> found;
  for (FrameWriter& frame : frames()) {
    if (const std::optional<BoardView> view = find_board(frame->gray, kBoard)) {
      found.push_back(*view);
    }
  }
  return found;
}

std::vector<std::string> write_images(const TemporaryFolder& folder, std::size_t count) {
  std::vector<std::string> paths;
  for (std::size_t i = 0; i < count; ++i) {
    paths.push_back(folder / ("view" + std::to_string(i) + ".png"));
    EXPECT_TRUE(write_png_bgr8(paths.back(), frames()[i]->bgr));
  }
  return paths;
}

/// A recording whose depth is `factor` too large, and a configuration that replays it with `camera`.
std::string recorded_config(const TemporaryFolder& folder, double factor, const CameraIntrinsics& camera) {
  TumWriterOptions options;
  options.depth_units_per_metre = true_camera().depth_units_per_metre * factor;
  TumWriter writer = TumWriter::create(folder.path() / "views", options).value();
  for (std::size_t i = 0; i < frames().size(); ++i) {
    frames()[i]->stamp_utc_ns = kTestStampNs + static_cast<std::int64_t>(i) * kTestPeriodNs;
    EXPECT_TRUE(writer.add_frame(*frames()[i]));
  }
  EXPECT_TRUE(writer.commit());
  folder.write("camera.toml", format_camera(camera, "Test."));
  return folder.write("config.toml",
                      "[camera]\ncalibration = \"camera.toml\"\n[source]\nkind = \"replay\"\npacing = \"lockstep\"\n"
                      "[source.replay]\nsequence = \"views\"\n");
}

TEST(Calibration, FindsTheCornersWithinAFractionOfAPixel) {
  const PinholeCamera camera(true_camera());
  const std::vector<Se3> truth = poses();
  const std::vector<BoardView> found = views();
  ASSERT_EQ(found.size(), truth.size()) << "every board is in the picture";
  double squares = 0;
  for (std::size_t v = 0; v < truth.size(); ++v) {
    for (std::size_t i = 0; i < kBoard.corners(); ++i) {
      const Eigen::Vector2d expected = camera.distort(camera.project(truth[v] * kBoard.corner(i)));
      const double forward = (found[v].corners[i] - expected).norm();
      const double backward = (found[v].corners[kBoard.corners() - 1 - i] - expected).norm();
      EXPECT_LT(std::min(forward, backward), 0.4) << "view " << v << ", corner " << i;
      squares += std::pow(std::min(forward, backward), 2);
    }
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(truth.size() * kBoard.corners())), 0.12) << "RMS";
}

TEST(Calibration, RecoversTheCamera) {
  CameraIntrinsics start = true_camera();
  start.fx = start.fy = 300;
  start.k1 = start.k2 = start.p1 = start.p2 = 0;
  const Result<Calibration> calibration = calibrate_camera(views(), kBoard, start, false);
  ASSERT_TRUE(calibration) << calibration.error().message;
  const CameraIntrinsics truth = true_camera();
  const CameraIntrinsics& found = calibration->camera;
  EXPECT_NEAR(found.fx, truth.fx, 0.002 * truth.fx);
  EXPECT_NEAR(found.fy, truth.fy, 0.002 * truth.fy);
  EXPECT_NEAR(found.cx, truth.cx, 0.7);
  EXPECT_NEAR(found.cy, truth.cy, 0.7);
  EXPECT_EQ(found.k3, 0.0);
  EXPECT_NEAR(found.baseline_fx, 20.0 * found.fx / 300.0, 1e-9);
  EXPECT_LT(calibration->rms_px, 0.1);
  EXPECT_GT(calibration->deviations[0], 0.0);
  EXPECT_NEAR(found.fx, truth.fx, 6 * calibration->deviations[0]) << "its own doubt covers the error";
  // Single coefficients trade against each other; what counts is where they put pixels.
  for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(40, 30), Eigen::Vector2d(360, 30), Eigen::Vector2d(200, 270)}) {
    const Eigen::Vector3d p_camera = PinholeCamera(truth).unproject(PinholeCamera(truth).undistort(pixel), 1.0);
    const PinholeCamera estimated(found);
    EXPECT_LT((estimated.distort(estimated.project(p_camera)) - pixel).norm(), 0.7);
  }
}

TEST(Calibration, NeedsViews) {
  std::vector<BoardView> few = views();
  few.resize(4);
  EXPECT_THAT(calibrate_camera(few, kBoard, true_camera(), false).error().message, HasSubstr("4 usable views"));
  EXPECT_FALSE(check_camera({}, kBoard, true_camera()));
  EXPECT_TRUE(check_camera(few, kBoard, true_camera()));
}

TEST(Calibration, SeesNoBoardWhereThereIsNone) {
  const std::vector<std::uint8_t> pixels(100 * 80, 128);
  EXPECT_FALSE(find_board({pixels.data(), 100, 80, 100, 1}, kBoard));
}

TEST(ViewSelector, TakesSharpViewsThatDiffer) {
  ViewSelector selector(kWidth, kHeight);
  BoardView view = views().front();
  EXPECT_TRUE(selector.offer(view));
  EXPECT_FALSE(selector.offer(view));
  std::reverse(view.corners.begin(), view.corners.end());
  EXPECT_FALSE(selector.offer(view)) << "the same view, found from its other end";
  const double before = selector.coverage();
  for (Eigen::Vector2d& corner : view.corners) {
    corner.x() += 60;
  }
  BoardView blurred = view;
  blurred.edge_width_px = 9;
  EXPECT_FALSE(selector.offer(blurred));
  EXPECT_TRUE(selector.offer(view));
  EXPECT_GT(selector.coverage(), before);
  EXPECT_LE(selector.coverage(), 1.0);
}

TEST(DepthFit, TellsScaleFromOffset) {
  std::vector<BoardDepth> points;
  for (int i = 0; i < 400; ++i) {
    const double expected_m = 0.5 + 0.002 * i;
    points.push_back({expected_m, 1.02 * expected_m + 0.004 + (i % 2 == 0 ? 0.001 : -0.001)});
  }
  points.push_back({1.0, 3.0});  // behind the board
  const DepthFit fit = fit_depth(points);
  EXPECT_EQ(fit.points, 400U);
  EXPECT_TRUE(fit.has_offset);
  EXPECT_NEAR(fit.scale, 1.02, 0.001);
  EXPECT_NEAR(fit.offset_m, 0.004, 0.0005);
  EXPECT_NEAR(fit.rms_m, 0.001, 0.0001);
}

TEST(DepthFit, OneDistanceTellsTheScaleAlone) {
  const DepthFit fit = fit_depth(std::vector<BoardDepth>(200, {1.0, 0.97}));
  EXPECT_FALSE(fit.has_offset);
  EXPECT_NEAR(fit.scale, 0.97, 1e-9);
  EXPECT_EQ(fit.offset_m, 0.0);
  EXPECT_EQ(fit_depth(std::vector<BoardDepth>(99, {1.0, 1.0})).points, 99U);
}

TEST(PosectlCalibrate, WritesAFileThatTheDaemonReads) {
  const TemporaryFolder folder;
  std::vector<std::string> arguments{"calibrate", "--board", "8x6", "--square", "0.03", "-o", folder / "camera.toml"};
  for (const std::string& image : write_images(folder, frames().size())) {
    arguments.push_back(image);
  }
  const Outcome outcome = posectl(arguments);
  ASSERT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("reprojection error"));
  const Result<CameraIntrinsics> camera = load_camera(folder / "camera.toml");
  ASSERT_TRUE(camera) << camera.error().message;
  EXPECT_EQ(camera->width, kWidth);
  EXPECT_NEAR(camera->fx, true_camera().fx, 1.0);
}

TEST(PosectlCalibrate, SaysWhyItCannot) {
  const TemporaryFolder folder;
  std::vector<std::string> few{"calibrate", "--square", "0.03"};
  for (const std::string& image : write_images(folder, 3)) {
    few.push_back(image);
  }
  const Outcome outcome = posectl(few);
  EXPECT_EQ(outcome.exit_code, kExitNegative);
  EXPECT_THAT(outcome.err, HasSubstr("3 usable views"));
  EXPECT_EQ(posectl({"calibrate", "--square", "0.03"}).exit_code, kExitUsage);
  EXPECT_EQ(posectl({"calibrate", "--square", "0.03", "--board", "8", folder / "view0.png"}).exit_code, kExitUsage);
  EXPECT_EQ(posectl({"calibrate", "--square", "0.03", "--check", folder / "view0.png"}).exit_code, kExitUsage);
  EXPECT_EQ(posectl({"calibrate", "--square", "0.03", folder / "none.png"}).exit_code, kExitNoInput);
}

TEST(PosectlCalibrate, ChecksTheDepthScale) {
  const std::vector<std::string> check{"calibrate", "--check", "--square", "0.03", "--config"};
  const auto run = [&](double factor, const CameraIntrinsics& camera) {
    const TemporaryFolder folder;
    std::vector<std::string> arguments = check;
    arguments.push_back(recorded_config(folder, factor, camera));
    return posectl(arguments);
  };
  const Outcome right = run(1.0, true_camera());
  EXPECT_EQ(right.exit_code, kExitOk) << right.out << right.err;
  EXPECT_THAT(right.out, testing::EndsWith("\nfine\n"));
  const Outcome wrong = run(1.02, true_camera());
  EXPECT_EQ(wrong.exit_code, kExitNegative);
  EXPECT_THAT(wrong.out, testing::ContainsRegex("depth: \\+(1\\.[89]|2\\.[0-2])[0-9] % in scale"));
  EXPECT_THAT(wrong.out, testing::ContainsRegex("depth_units_per_metre = 10(19|20|21)\\."));
  CameraIntrinsics lens = true_camera();
  lens.k1 = 0.1;
  EXPECT_EQ(run(1.0, lens).exit_code, kExitNegative) << "another lens";
}

}  // namespace
}  // namespace posed
