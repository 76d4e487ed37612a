#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <ostream>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ostream.h>

#include "config/config_loader.h"
#include "core/clock.h"
#include "core/detections.h"
#include "detect/person_detector.h"
#include "drivers/image_writer.h"
#include "tools/posectl/color_image.h"
#include "tools/posectl/commands.h"
#include "tools/posectl/exit_code.h"
#include "tools/posectl/interrupt.h"
#include "tools/posectl/progress.h"
#include "tools/posectl/report_error.h"
#include "tools/posectl/whole_file.h"

namespace posed {
namespace {

struct DetectOptions {
  std::vector<std::filesystem::path> images;
  std::filesystem::path config;
  std::string model;
  std::filesystem::path csv;
  std::filesystem::path draw;
  double score = -1;  // that of the configuration
  bool quiet = false;
};

/// The images named, and those of the folders named, by name.
Result<std::vector<std::filesystem::path>> list_images(const std::vector<std::filesystem::path>& named) {
  std::vector<std::filesystem::path> images;
  for (const std::filesystem::path& path : named) {
    std::error_code failed;
    if (!std::filesystem::is_directory(path, failed)) {
      images.push_back(path);
      continue;
    }
    std::vector<std::filesystem::path> inside;
    for (std::filesystem::directory_iterator entry(path, failed), end; !failed && entry != end; entry.increment(failed)) {
      const std::string suffix = entry->path().extension().string();
      if (suffix == ".jpg" || suffix == ".jpeg" || suffix == ".png") {
        inside.push_back(entry->path());
      }
    }
    if (failed) {
      return make_error(ErrorCode::Io, fmt::format("{}: {}", path.string(), failed.message()));
    }
    if (inside.empty()) {
      return make_error(ErrorCode::NotFound, fmt::format("{}: no image (.jpg, .jpeg, .png) in this folder", path.string()));
    }
    std::sort(inside.begin(), inside.end());
    images.insert(images.end(), inside.begin(), inside.end());
  }
  return images;
}

void draw_box(ImageView<std::uint8_t> bgr, const BoundingBox& box) {
  constexpr int kLine = 2;  // [pixels]
  const auto column = [&](float x) { return std::clamp(static_cast<int>(x + 0.5F), 0, bgr.width - 1); };
  const auto row = [&](float y) { return std::clamp(static_cast<int>(y + 0.5F), 0, bgr.height - 1); };
  const int left = column(box.x_min);
  const int right = column(box.x_max);
  const int top = row(box.y_min);
  const int bottom = row(box.y_max);
  for (int y = top; y <= bottom; ++y) {
    for (int x = left; x <= right; ++x) {
      if (x < left + kLine || x > right - kLine || y < top + kLine || y > bottom - kLine) {
        std::uint8_t* const pixel = &bgr.at(x, y);
        pixel[0] = 0;
        pixel[1] = 255;
        pixel[2] = 0;
      }
    }
  }
}

/// The detector, and the file it runs.
Result<std::pair<std::unique_ptr<MultiScaleDetector>, std::string>> load_model(const DetectOptions& options) {
  const Result<Config> config = options.config.empty() ? default_config() : load_config(options.config);
  if (!config) {
    return tl::unexpected<Error>(config.error());
  }
  DetectorConfig detector = config->detector;
  if (options.score >= 0) {
    detector.score = options.score;
  }
  if (options.model.empty() && detector.models.empty()) {
    return make_error(ErrorCode::InvalidConfig, "the configuration names no model; name one by --model");
  }
  const std::string name = options.model.empty() ? detector.models.back() : options.model;
  Result<std::unique_ptr<MultiScaleDetector>> loaded = load_object_detector(detector, parse_model_name(name));
  if (!loaded) {
    return tl::unexpected<Error>(loaded.error());
  }
  return std::pair(std::move(*loaded), std::filesystem::path(name).filename().string());
}

std::string table_row(const std::string& name, const Detection& d) {
  return fmt::format("{:<28} {:>6.3f} {:>8.1f} {:>8.1f} {:>8.1f} {:>8.1f}\n", name, d.score, d.box.x_min, d.box.y_min, d.box.x_max,
                     d.box.y_max);
}

std::string csv_row(const std::string& name, const Detection& d) {
  return fmt::format("{} {:.6f} {:.2f} {:.2f} {:.2f} {:.2f}\n", name, d.score, d.box.x_min, d.box.y_min, d.box.x_max, d.box.y_max);
}

Status prepare_outputs(const DetectOptions& options) {
  if (!options.draw.empty()) {
    std::error_code failed;
    std::filesystem::create_directories(options.draw, failed);
    if (failed) {
      return make_error(ErrorCode::Io, fmt::format("{}: {}", options.draw.string(), failed.message()));
    }
  }
  return options.csv.empty() ? Status{} : check_writable(options.csv);
}

int run_detect(const DetectOptions& options, const Console& console) {
  const Result<std::vector<std::filesystem::path>> images = list_images(options.images);
  if (!images) {
    return report_error(console.err, images.error());
  }
  const Status prepared = prepare_outputs(options);
  if (!prepared) {
    return report_error(console.err, prepared.error());
  }
  const auto loaded = load_model(options);
  if (!loaded) {
    return report_error(console.err, loaded.error());
  }
  const auto& [detector, model] = *loaded;
  const Clock& clock = SystemClock::instance();
  const InterruptGuard interrupt;
  ProgressReporter progress(console.err, progress_style(console.err_is_terminal, options.quiet), "detect", images->size(),
                            clock.now_ns());
  ColorImage image;
  Detections found;
  std::string table;
  std::string csv;
  std::size_t people = 0;
  std::size_t done = 0;
  int exit_code = kExitOk;
  for (const std::filesystem::path& path : *images) {
    if (interrupt.requested()) {
      break;
    }
    ++done;
    if (const Status read = image.read(path); !read) {
      exit_code = report_error(console.err, read.error());  // the others are looked at all the same
      continue;
    }
    if (const Result<MultiScaleOutcome> outcome = detector->detect(image.bgr(), Deadline{}, found); !outcome) {
      return report_error(console.err, outcome.error());
    }
    const std::string name = path.stem().string();
    people += found.count;
    for (const Detection& d : found.found()) {
      table += table_row(name, d);
      csv += csv_row(name, d);
      draw_box(image.bgr(), d.box);
    }
    if (!options.draw.empty()) {
      if (const Status drawn = write_png_bgr8(options.draw / (name + ".png"), image.bgr()); !drawn) {
        return report_error(console.err, drawn.error());
      }
    }
    progress.update(done, clock.now_ns());
  }
  progress.finish(done, clock.now_ns());
  if (!options.csv.empty()) {
    if (const Status written = write_whole_file(options.csv, csv); !written) {
      return report_error(console.err, written.error());
    }
  } else {
    fmt::print(console.out, "{:<28} {:>6} {:>8} {:>8} {:>8} {:>8}\n{}", "image", "score", "x_min", "y_min", "x_max", "y_max",
               table);
  }
  fmt::print(console.out, "{} people in {} images, by {} ({})\n", people, done, model, detector->name());
  return exit_code;
}

}  // namespace

void add_detect_command(CLI::App& parent, const Console& console, int& exit_code) {
  auto options = std::make_shared<DetectOptions>();
  CLI::App* command = parent.add_subcommand("detect", "Look for people in images");
  command->add_option("images", options->images, "Image files (PNG, JPEG), or folders of them")->required();
  command->add_option("--config", options->config,
                      "Configuration of the daemon, for its [detector]; built-in defaults unless given");
  command->add_option("--model", options->model,
                      "Network, with @WIDTHxHEIGHT for another input than the file's, or several joined by +; the last of "
                      "detector.models unless given");
  command->add_option("--score", options->score, "Least confidence; that of the configuration unless given")
      ->check(CLI::Range(0.001, 0.999));
  command->add_option("--csv", options->csv,
                      "Write lines `name score x_min y_min x_max y_max` [pixels of the image] instead of a table");
  command->add_option("--draw", options->draw, "Folder for copies of the images with the boxes drawn on them; it is made");
  command->add_flag("--quiet", options->quiet, "No progress");
  command->callback([options, &console, &exit_code] { exit_code = run_detect(*options, console); });
}

}  // namespace posed
