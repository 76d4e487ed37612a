#include "slam/orb_extractor.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "slam/orb_corners.h"
#include "slam/orb_pattern.h"
#include "slam/orb_pyramid.h"
#include "slam/orb_quadtree.h"

namespace posed {
namespace {

// Distance from a level's border within which there is no keypoint: the patch and its smoothing are complete beyond it.
constexpr int kBorder = kPatchRadius + 1;

// Keypoints for each level, proportional to the level's side length, `features` in all.
std::vector<int> level_quotas(int features, int levels, double scale) {
  double total = 0;
  for (int level = 0; level < levels; ++level) {
    total += std::pow(scale, -level);
  }
  std::vector<int> quotas;
  double exact = 0;
  int given = 0;
  for (int level = 0; level < levels; ++level) {
    exact += features * std::pow(scale, -level) / total;
    quotas.push_back(static_cast<int>(std::lround(exact)) - given);
    given += quotas.back();
  }
  return quotas;
}

}  // namespace

struct OrbExtractor::Workspace {
  Workspace(const TrackerConfig& config, int width, int height, const OrbKernels& kernels_in)
      : kernels(kernels_in),
        pyramid(width, height, config.pyramid_levels, config.pyramid_scale, 2 * kBorder + 1, kernels_in),
        detector(width, kBorder, config.fast_threshold, config.fast_threshold_minimum, kernels_in),
        pattern(pyramid.stride()),
        quotas(level_quotas(config.features, pyramid.level_count(), config.pyramid_scale)),
        most_features(static_cast<std::size_t>(config.features)) {
    corners.reserve(CornerDetector::max_corners(width, height));
    for (int level = 0; level < pyramid.level_count(); ++level) {
      const ImageView<const std::uint8_t> image = pyramid.image(level);
      const int quota = quotas[static_cast<std::size_t>(level)];
      trees.emplace_back(image.width, image.height, kBorder, quota);
      most_features += CornerQuadtree::kMostExcess;
      selected.reserve(std::max(selected.capacity(), static_cast<std::size_t>(quota) + CornerQuadtree::kMostExcess));
    }
  }

  void describe_level(int level, Features& features) const;
  void leave_out(int level, std::span<const std::uint8_t> cells);

  const OrbKernels& kernels;
  OrbPyramid pyramid;
  CornerDetector detector;
  RotatedPattern pattern;
  std::vector<int> quotas;            ///< by level
  std::vector<CornerQuadtree> trees;  ///< by level
  std::size_t most_features;
  std::vector<Corner> corners;   ///< of the present level
  std::vector<Corner> selected;  ///< of the present level
};

void OrbExtractor::Workspace::describe_level(int level, Features& features) const {
  const ImageView<const std::uint8_t> full = pyramid.image(0);
  const ImageView<const std::uint8_t> image = pyramid.image(level);
  const ImageView<const std::uint8_t> smoothed = pyramid.smoothed(level);
  const double scale_x = static_cast<double>(full.width) / image.width;
  const double scale_y = static_cast<double>(full.height) / image.height;
  for (const Corner& corner : selected) {
    int m10 = 0;
    int m01 = 0;
    kernels.moments(&image.at(corner.x, corner.y), image.stride, &m10, &m01);
    Keypoint keypoint;
    // Levels coincide at their corners, not at the centres of their corner pixels.
    keypoint.x = static_cast<float>((corner.x + 0.5) * scale_x - 0.5);
    keypoint.y = static_cast<float>((corner.y + 0.5) * scale_y - 0.5);
    keypoint.angle_rad = orientation_rad(m10, m01);
    keypoint.level = static_cast<std::uint8_t>(level);
    keypoint.response = static_cast<std::uint8_t>(corner.score - 1);
    features.keypoints.push_back(keypoint);
    Descriptor& descriptor = features.descriptors.emplace_back();
    kernels.describe(&smoothed.at(corner.x, corner.y), pattern.offsets(keypoint.angle_rad), descriptor.data());
  }
}

void OrbExtractor::Workspace::leave_out(int level, std::span<const std::uint8_t> cells) {
  const ImageView<const std::uint8_t> full = pyramid.image(0);
  const ImageView<const std::uint8_t> image = pyramid.image(level);
  const int columns = (full.width + kMaskCell - 1) / kMaskCell;
  std::erase_if(corners, [&](const Corner& corner) {
    // A corner's centre in whole cells of the full image, without rounding: the same on every machine.
    const int column = (2 * corner.x + 1) * full.width / (2 * image.width * kMaskCell);
    const int row = (2 * corner.y + 1) * full.height / (2 * image.height * kMaskCell);
    return cells[static_cast<std::size_t>(row * columns + column)] != 0;
  });
}

OrbExtractor::OrbExtractor(const TrackerConfig& config, int width, int height)
    : OrbExtractor(config, width, height, best_simd_level()) {}

OrbExtractor::OrbExtractor(const TrackerConfig& config, int width, int height, SimdLevel simd_level)
    : workspace_(std::make_unique<Workspace>(config, width, height, orb_kernels(simd_level))) {}

OrbExtractor::~OrbExtractor() = default;
OrbExtractor::OrbExtractor(OrbExtractor&&) noexcept = default;

void OrbExtractor::extract(ImageView<const std::uint8_t> gray, Features& features, std::span<const std::uint8_t> left_out) {
  Workspace& w = *workspace_;
  features.keypoints.clear();
  features.descriptors.clear();
  features.keypoints.reserve(w.most_features);
  features.descriptors.reserve(w.most_features);
  w.pyramid.set_image(gray);
  for (int level = 0; level < w.pyramid.level_count(); ++level) {
    if (level > 0) {
      w.pyramid.resize_to(level);
    }
    w.detector.detect(w.pyramid.image(level), w.corners);
    if (!left_out.empty()) {
      w.leave_out(level, left_out);
    }
    w.trees[static_cast<std::size_t>(level)].select(w.corners, w.quotas[static_cast<std::size_t>(level)], w.selected);
    if (!w.selected.empty()) {
      w.pyramid.smooth(level);
      w.describe_level(level, features);
    }
  }
}

}  // namespace posed
