#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <ostream>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/ostream.h>

#include "config/config_loader.h"
#include "core/clock.h"
#include "drivers/pixel_conversion.h"
#include "drivers/rgbd_source.h"
#include "tools/posectl/calibration_views.h"
#include "tools/posectl/camera_text.h"
#include "tools/posectl/chessboard.h"
#include "tools/posectl/color_image.h"
#include "tools/posectl/commands.h"
#include "tools/posectl/exit_code.h"
#include "tools/posectl/interrupt.h"
#include "tools/posectl/report_error.h"
#include "tools/posectl/whole_file.h"

namespace posed {
namespace {

namespace fs = std::filesystem;

constexpr double kFairCoverage = 0.6;
constexpr double kLargestFocalDeviation = 0.005;  // of the focal length
constexpr double kFineRms_px = 1.0;
constexpr double kFineDepthScale = 0.01;
constexpr double kFineDepthOffset_m = 0.01;

struct CalibrateOptions {
  std::vector<fs::path> images;
  fs::path config;
  fs::path camera;
  fs::path out;
  std::string board = "8x6";
  double square_m = 0;
  std::size_t views = 20;
  bool with_k3 = false;
  bool check = false;
};

/// What was seen of the board. `depths` has an entry a view where the source has depth.
struct Seen {
  CameraIntrinsics camera;  ///< as calibrated until now; for images without a calibration only its size counts
  std::optional<ViewSelector> selector;
  std::vector<std::vector<float>> depths;
};

Result<Board> parse_board(const CalibrateOptions& options) {
  Board board;
  const std::string& text = options.board;
  const char* const end = text.data() + text.size();
  const auto [after_columns, first] = std::from_chars(text.data(), end, board.columns);
  if (first == std::errc{} && after_columns != end && *after_columns == 'x') {
    const auto [after_rows, second] = std::from_chars(after_columns + 1, end, board.rows);
    if (second == std::errc{} && after_rows == end && board.columns >= 3 && board.rows >= 3 && board.columns <= 50 &&
        board.rows <= 50) {
      board.square_m = options.square_m;
      return board;
    }
  }
  return make_error(ErrorCode::InvalidArgument,
                    fmt::format("--board {}: not COLUMNSxROWS of inner corners, from 3x3 to 50x50, as in 8x6", text));
}

void print_view(const Seen& seen, const std::string& name, const Console& console) {
  fmt::print(console.err, "view {} ({}), {:.0f} % of the image covered\n", seen.selector->views().size(), name,
             100 * seen.selector->coverage());
}

Status look_at_images(const CalibrateOptions& options, const Board& board, Seen& seen, const Console& console) {
  ColorImage image;
  for (const fs::path& path : options.images) {
    if (Status read = image.read(path); !read) {
      return read;
    }
    const ImageView<std::uint8_t> bgr = image.bgr();
    if (!seen.selector) {
      if (!options.camera.empty() && (seen.camera.width != bgr.width || seen.camera.height != bgr.height)) {
        return make_error(ErrorCode::InvalidArgument, fmt::format("{} is {}x{}, the calibration is for {}x{}", path.string(),
                                                                  bgr.width, bgr.height, seen.camera.width, seen.camera.height));
      }
      seen.camera.width = bgr.width;
      seen.camera.height = bgr.height;
      seen.selector.emplace(bgr.width, bgr.height);
    }
    if (seen.camera.width != bgr.width || seen.camera.height != bgr.height) {
      return make_error(ErrorCode::InvalidArgument, fmt::format("{} is {}x{}, the images before it {}x{}", path.string(), bgr.width,
                                                                bgr.height, seen.camera.width, seen.camera.height));
    }
    std::vector<std::uint8_t> pixels(static_cast<std::size_t>(bgr.width) * static_cast<std::size_t>(bgr.height));
    const ImageView<std::uint8_t> gray{pixels.data(), bgr.width, bgr.height, bgr.width, 1};
    gray_from_bgr(bgr, gray);
    const std::optional<BoardView> view = find_board(gray, board);
    if (view && seen.selector->offer(*view)) {
      print_view(seen, path.filename().string(), console);
    } else {
      fmt::print(console.err, "{}: {}\n", path.string(), view ? "blurred, or much like a view before" : "the board was not found");
    }
  }
  return {};
}

std::vector<float> packed(ImageView<const float> image) {
  std::vector<float> pixels;
  for (int y = 0; y < image.height; ++y) {
    pixels.insert(pixels.end(), image.row(y), image.row(y) + image.width);
  }
  return pixels;
}

Status look_at_source(const CalibrateOptions& options, const Config& config, const Board& board, Seen& seen,
                      const Console& console) {
  Result<std::unique_ptr<RgbdSource>> opened = make_rgbd_source(config.source, config.intrinsics, SystemClock::instance());
  if (!opened) {
    return tl::unexpected(std::move(opened).error());
  }
  FramePool pool(config.intrinsics.width, config.intrinsics.height, (*opened)->info().slots_held + 2);
  const std::unique_ptr<RgbdSource> source = *std::move(opened);  // goes before the pool does
  if (Status started = source->start(pool); !started) {
    return started;
  }
  const InterruptGuard interrupt;
  std::stop_source stop;
  const std::jthread watch([&](const std::stop_token& done) {
    while (!done.stop_requested() && !interrupt.requested()) {
      SystemClock::instance().sleep_until(SystemClock::instance().now_ns() + 20 * kNsPerMs);
    }
    stop.request_stop();
  });
  fmt::print(console.err,
             "Show the board at all places of the image, near and far, tilted by some 30 degrees; {} views are taken.\n",
             options.views);
  seen.selector.emplace(config.intrinsics.width, config.intrinsics.height);
  while (seen.selector->views().size() < options.views) {
    const Capture capture = source->next(stop.get_token());
    if (capture.kind == CaptureKind::Frame) {
      const std::optional<BoardView> view = find_board(capture.frame->gray, board);
      if (view && seen.selector->offer(*view)) {
        seen.depths.push_back(packed(capture.frame->depth_m));
        print_view(seen, fmt::format("frame {}", capture.frame->sequence), console);
      }
    } else if (capture.kind == CaptureKind::Failed) {
      return tl::unexpected(capture.error);
    } else if (capture.kind == CaptureKind::EndOfStream || capture.kind == CaptureKind::Stopped) {
      break;
    } else if (!capture.error.message.empty()) {
      fmt::print(console.err, "posectl: {}\n", capture.error.message);
    }
  }
  return {};
}

DepthFit depth_of(const Seen& seen, const Board& board, const Calibration& calibration) {
  std::vector<BoardDepth> points;
  const PinholeCamera camera(calibration.camera);
  for (std::size_t i = 0; i < seen.depths.size(); ++i) {
    const int width = calibration.camera.width;
    sample_board_depth(board, calibration.T_camera_board[i], camera,
                       {seen.depths[i].data(), width, calibration.camera.height, width, 1}, points);
  }
  return fit_depth(points);
}

void print_calibration(const Calibration& calibration, bool with_deviations, std::ostream& out) {
  const CameraIntrinsics& k = calibration.camera;
  const std::array names{"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"};
  const std::array values{k.fx, k.fy, k.cx, k.cy, k.k1, k.k2, k.p1, k.p2, k.k3};
  for (std::size_t i = 0; i < names.size(); ++i) {
    fmt::print(out, "{} {:12.6f}{}\n", names[i], values[i],
               with_deviations ? fmt::format("  +- {:.6f}", calibration.deviations[i]) : "");
  }
  fmt::print(out, "reprojection error, RMS [pixels]: {:.3f}\n", calibration.rms_px);
  for (std::size_t i = 0; i < calibration.view_rms_px.size(); ++i) {
    fmt::print(out, "  view {}: {:.3f}\n", i + 1, calibration.view_rms_px[i]);
  }
}

/// True where depth is as it should be, or there is none to judge.
bool print_depth(const Seen& seen, const DepthFit& fit, std::ostream& out) {
  if (seen.depths.empty()) {
    return true;
  }
  if (fit.points < 100) {
    fmt::print(out, "depth: only {} points of the board have depth near to where they are; nothing can be said\n", fit.points);
    return false;
  }
  const bool fine = std::abs(fit.scale - 1) <= kFineDepthScale && std::abs(fit.offset_m) <= kFineDepthOffset_m;
  fmt::print(out, "depth: {:+.2f} % in scale, {}, {:.1f} mm RMS left, over {} points\n", 100 * (fit.scale - 1),
             fit.has_offset ? fmt::format("{:+.1f} mm offset", 1000 * fit.offset_m)
                            : std::string("offset unknown (show the board near and far)"),
             1000 * fit.rms_m, fit.points);
  if (!fine) {
    fmt::print(out, "depth_units_per_metre = {:.4f} would mend the scale; it is {:.4f}\n",
               seen.camera.depth_units_per_metre * fit.scale, seen.camera.depth_units_per_metre);
  }
  return fine;
}

void warn(const Seen& seen, const Calibration& calibration, std::ostream& err) {
  if (seen.selector->coverage() < kFairCoverage) {
    fmt::print(err,
               "posectl: only {:.0f} % of the image was covered: distortion is a guess where the board never was; show it there\n",
               100 * seen.selector->coverage());
  }
  if (calibration.deviations[0] > kLargestFocalDeviation * calibration.camera.fx) {
    fmt::print(err, "posectl: the focal length is uncertain by {:.2f} %; tilt the board more\n",
               100 * calibration.deviations[0] / calibration.camera.fx);
  }
}

int check(const Seen& seen, const Board& board, const Console& console) {
  const Result<Calibration> calibration = check_camera(seen.selector->views(), board, seen.camera);
  if (!calibration) {
    fmt::print(console.err, "posectl: {}\n", calibration.error().message);
    return kExitNegative;
  }
  print_calibration(*calibration, false, console.out);
  const bool depth_fine = print_depth(seen, depth_of(seen, board, *calibration), console.out);
  const bool fine = depth_fine && calibration->rms_px <= kFineRms_px;
  fmt::print(console.out, "{}\n", fine ? "fine" : "not fine");
  return fine ? kExitOk : kExitNegative;
}

int calibrate(const CalibrateOptions& options, const Seen& seen, const Board& board, const Console& console) {
  const Result<Calibration> calibration = calibrate_camera(seen.selector->views(), board, seen.camera, options.with_k3);
  if (!calibration) {
    fmt::print(console.err, "posectl: {}\n", calibration.error().message);
    return kExitNegative;
  }
  print_calibration(*calibration, true, console.out);
  print_depth(seen, depth_of(seen, board, *calibration), console.out);
  warn(seen, *calibration, console.err);
  const std::string text = format_camera(
      calibration->camera, fmt::format("Calibrated by posectl from {} views of a board of {} corners: {:.3f} pixels RMS.",
                                       seen.selector->views().size(), options.board, calibration->rms_px));
  const Status usable = parse_camera(text, options.out).map([](const CameraIntrinsics&) {});
  const Status written = usable && !options.out.empty() ? write_whole_file(options.out, text) : usable;
  if (!written) {
    return report_error(console.err, written.error());
  }
  fmt::print(console.out, "{}", options.out.empty() ? text : fmt::format("{} is written\n", options.out.string()));
  return kExitOk;
}

int run_calibrate(const CalibrateOptions& options, const Console& console) {
  const Result<Board> board = parse_board(options);
  if (!board) {
    return report_error(console.err, board.error());
  }
  if (options.images.empty() == options.config.empty()) {
    return report_error(console.err, {ErrorCode::InvalidArgument, "give either images or --config FILE"});
  }
  if (options.check && !options.images.empty() && options.camera.empty()) {
    return report_error(console.err, {ErrorCode::InvalidArgument, "--check of images needs --camera FILE"});
  }
  if (const Status writable = options.out.empty() ? Status() : check_writable(options.out); !writable) {
    return report_error(console.err, writable.error());
  }
  Seen seen;
  Result<Config> config = options.config.empty() ? default_config() : load_config(options.config);
  const Result<CameraIntrinsics> camera =
      options.camera.empty() ? Result<CameraIntrinsics>(CameraIntrinsics{}) : load_camera(options.camera);
  if (!config || !camera) {
    return report_error(console.err, !config ? config.error() : camera.error());
  }
  seen.camera = !options.camera.empty() || options.config.empty() ? *camera : config->intrinsics;
  config->intrinsics = options.config.empty() ? config->intrinsics : seen.camera;
  const Status looked = options.config.empty() ? look_at_images(options, *board, seen, console)
                                               : look_at_source(options, *config, *board, seen, console);
  if (!looked) {
    return report_error(console.err, looked.error());
  }
  return options.check ? check(seen, *board, console) : calibrate(options, seen, *board, console);
}

}  // namespace

void add_calibrate_command(CLI::App& parent, const Console& console, int& exit_code) {
  auto options = std::make_shared<CalibrateOptions>();
  CLI::App* command = parent.add_subcommand("calibrate", "Make or check the camera's calibration with a chessboard");
  command->add_option("image", options->images, "Images of the board (PNG, JPEG)");
  command->add_option("--config", options->config, "The daemon's configuration (TOML): take views live from its [source]");
  command->add_option("--camera", options->camera, "Calibration to check, or to keep size, depth units and baseline of");
  command->add_option("--board", options->board, "COLUMNSxROWS of its inner corners")->capture_default_str();
  command->add_option("--square", options->square_m, "Side of a square [m]")->required()->check(CLI::PositiveNumber);
  command->add_option("--images", options->views, "Views to take live")->check(CLI::Range(1, 1000))->capture_default_str();
  CLI::Option* with_k3 = command->add_flag("--k3", options->with_k3, "Estimate k3, too: for wide lenses and full coverage");
  CLI::Option* out = command->add_option("-o,--out", options->out, "Calibration file to write (TOML); without it, it is printed");
  command
      ->add_flag("--check", options->check, "Only compare the calibration with what is seen: exit code 0 where it is fine, else 1")
      ->excludes(out)
      ->excludes(with_k3);
  command->callback([options, &console, &exit_code] { exit_code = run_calibrate(*options, console); });
}

}  // namespace posed
