#include "tools/posectl/mask_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "drivers/image_writer.h"

namespace posed {
namespace {

constexpr int kSampling = 2;  // [pixels] masks are compared at every other pixel of every other row

std::string stamp_name(std::int64_t stamp_ns) {
  return fmt::format("{}.{:06d}", stamp_ns / kNsPerSecond, stamp_ns % kNsPerSecond / kNsPerUs);
}

/// Recordings name their images by stamps to the microsecond or to the nanosecond.
std::filesystem::path mask_path(const std::filesystem::path& folder, std::int64_t stamp_ns) {
  std::filesystem::path path = folder / (stamp_name(stamp_ns) + ".png");
  if (std::error_code ignored; !std::filesystem::exists(path, ignored)) {
    const auto precise = folder / fmt::format("{}.{:09d}.png", stamp_ns / kNsPerSecond, stamp_ns % kNsPerSecond);
    return std::filesystem::exists(precise, ignored) ? precise : path;
  }
  return path;
}

double share(std::uint64_t part, std::uint64_t rest) {
  return part + rest > 0 ? static_cast<double>(part) / static_cast<double>(part + rest) : 0.0;
}

void count(MaskScore& score, bool judged, bool truth) {
  score.true_positive += judged && truth ? 1 : 0;
  score.false_positive += judged && !truth ? 1 : 0;
  score.false_negative += !judged && truth ? 1 : 0;
}

int nearest(float coordinate, int size) {
  return std::clamp(static_cast<int>(std::lround(coordinate)), 0, size - 1);
}

constexpr std::array<std::uint8_t, 3> kKeptBgr{0, 255, 0};
constexpr std::array<std::uint8_t, 3> kLeftOutBgr{255, 64, 0};

void dot(ImageView<std::uint8_t> bgr, float x, float y, const std::array<std::uint8_t, 3>& color) {
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      std::uint8_t* const pixel =
          &bgr.at(nearest(x + static_cast<float>(dx), bgr.width), nearest(y + static_cast<float>(dy), bgr.height));
      std::copy(color.begin(), color.end(), pixel);
    }
  }
}

bool is_left_out(const TrackedView& view, float x, float y) {
  const ImageView<float>& depth = view.frame.depth_m;
  return view.mask != nullptr && view.mask->is_mover(x, y, depth.at(nearest(x, depth.width), nearest(y, depth.height)));
}

}  // namespace

double MaskScore::recall() const {
  return share(true_positive, false_negative);
}
double MaskScore::precision() const {
  return share(true_positive, false_positive);
}
double MaskScore::intersection_over_union() const {
  return share(true_positive, false_positive + false_negative);
}

MaskReport::MaskReport(Options options, const Config& config)
    : options_(std::move(options)), extractor_(config.tracker, config.intrinsics.width, config.intrinsics.height) {}

void MaskReport::add(const TrackedView& view) {
  ++frames_;
  const bool draws = !options_.draw.empty() && (frames_ - 1) % static_cast<std::uint64_t>(options_.draw_every) == 0;
  const bool compares = !options_.truth.empty();
  if (status_ && (draws || compares)) {
    extractor_.extract(view.frame.gray, features_);
  }
  if (status_ && draws) {
    status_ = draw(view);
  }
  if (status_ && compares) {
    status_ = compare(view);
  }
}

Status MaskReport::draw(const TrackedView& view) {
  const ImageView<std::uint8_t>& from = view.frame.bgr;
  picture_.resize(static_cast<std::size_t>(from.width) * static_cast<std::size_t>(from.height) * 3);
  const ImageView<std::uint8_t> bgr{picture_.data(), from.width, from.height, std::ptrdiff_t{3} * from.width, 3};
  const int columns = view.mask != nullptr ? view.mask->depth().columns() : 0;
  for (int y = 0; y < from.height; ++y) {
    std::copy_n(from.row(y), std::ptrdiff_t{3} * from.width, bgr.row(y));
    for (int x = 0; x < from.width && view.mask != nullptr; ++x) {
      if (view.mask->cells()[static_cast<std::size_t>(y / DepthGrid::kCell * columns + x / DepthGrid::kCell)] != 0) {
        std::uint8_t* const pixel = &bgr.at(x, y);
        pixel[2] = static_cast<std::uint8_t>(128 + pixel[2] / 2);
      }
    }
  }
  for (const Keypoint& keypoint : features_.keypoints) {
    if (is_left_out(view, keypoint.x, keypoint.y)) {
      dot(bgr, keypoint.x, keypoint.y, kLeftOutBgr);
    }
  }
  if (view.features != nullptr) {
    for (const Keypoint& keypoint : view.features->keypoints) {
      dot(bgr, keypoint.x, keypoint.y, kKeptBgr);
    }
  }
  return write_jpeg_bgr(options_.draw / (stamp_name(view.frame.stamp_utc_ns) + ".jpg"), bgr, 85);
}

Status MaskReport::compare(const TrackedView& view) {
  const std::filesystem::path path = mask_path(options_.truth, view.frame.stamp_utc_ns);
  if (Status read = truth_.read(path); !read) {
    return read;
  }
  const ImageView<std::uint8_t> truth = truth_.bgr();
  const ImageView<float>& depth = view.frame.depth_m;
  if (truth.width != depth.width || truth.height != depth.height) {
    return make_error(ErrorCode::BadData, fmt::format("{}: the mask is {} x {}, the frame {} x {}", path.string(), truth.width,
                                                      truth.height, depth.width, depth.height));
  }
  const auto is_true = [&](float x, float y) { return truth.at(nearest(x, truth.width), nearest(y, truth.height)) != 0; };
  for (int y = 0; y < truth.height; y += kSampling) {
    for (int x = 0; x < truth.width; x += kSampling) {
      const auto u = static_cast<float>(x);
      const auto v = static_cast<float>(y);
      count(pixels_, is_left_out(view, u, v), is_true(u, v));
    }
  }
  for (const Keypoint& keypoint : features_.keypoints) {
    count(found_, is_left_out(view, keypoint.x, keypoint.y), is_true(keypoint.x, keypoint.y));
  }
  if (view.features != nullptr) {
    for (const Keypoint& keypoint : view.features->keypoints) {
      ++kept_;
      kept_on_movers_ += is_true(keypoint.x, keypoint.y) ? 1 : 0;
    }
  }
  return {};
}

std::string MaskReport::summary() const {
  if (options_.truth.empty() || frames_ == 0) {
    return {};
  }
  const auto line = [](const char* name, const MaskScore& score) {
    return fmt::format("{:12} IoU {:.3f}  recall {:.3f}  precision {:.3f}\n", name, score.intersection_over_union(), score.recall(),
                       score.precision());
  };
  return line("mask", pixels_) + line("features", found_) +
         fmt::format("kept         {:.0f} features a frame, {:.2f} % of them on movers\n",
                     static_cast<double>(kept_) / static_cast<double>(frames_),
                     100 * share(kept_on_movers_, kept_ - kept_on_movers_));
}

}  // namespace posed
