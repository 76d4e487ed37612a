// Learns the tests of the descriptor (orb_pattern_table.inc) from images. Built on demand: cmake --build ... --target
// learn_orb_pattern.
//
//   learn_orb_pattern FOLDER > slam/orb_pattern_table.inc
//
// As in section 4.3 of Rublee et al., ORB, 2011, tests are taken greedily that are balanced over many oriented patches and hardly
// correlated with those taken before. Here they are taken in the order of how often their answer changes when the image is turned,
// scaled and made noisy, so that of equally informative tests the repeatable ones win. Deterministic.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "slam/orb_corners.h"
#include "slam/orb_pattern.h"
#include "slam/orb_pyramid.h"
#include "slam/orb_quadtree.h"

namespace posed {
namespace {

constexpr std::size_t kImages = 120;
constexpr int kCornersPerImage = 250;
constexpr int kCandidates = 60'000;
constexpr double kLargestImbalance = 0.1;  ///< of the share of ones, from a half
constexpr int kMargin = 3 * kPatchRadius;

struct Point {
  int x, y;
};

std::vector<Point> disc_points() {
  std::vector<Point> points;
  for (int y = -kPatchRadius; y <= kPatchRadius; ++y) {
    for (int x = -kPatchRadius; x <= kPatchRadius; ++x) {
      if (x * x + y * y <= kPatchRadius * kPatchRadius) {
        points.push_back({x, y});
      }
    }
  }
  return points;
}

ImageView<const std::uint8_t> view(const cv::Mat& image) {
  return {image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step), 1};
}

/// Oriented patches: grey levels of the smoothed image at the points of the disc, turned to the patch's orientation.
class PatchSampler {
 public:
  PatchSampler(int width, int height)
      : kernels_(orb_kernels(best_simd_level())), points_(disc_points()), pyramid_(width, height, 1, 1.2, 33, kernels_) {}

  void set_image(const cv::Mat& image) {
    pyramid_.set_image(view(image));
    pyramid_.smooth(0);
  }

  void append(int x, int y, std::vector<std::uint8_t>& patches) const {
    const ImageView<const std::uint8_t> image = pyramid_.image(0);
    const ImageView<const std::uint8_t> smoothed = pyramid_.smoothed(0);
    int m10 = 0;
    int m01 = 0;
    kernels_.moments(&image.at(x, y), image.stride, &m10, &m01);
    const double angle_rad = std::round(orientation_rad(m10, m01) * RotatedPattern::kOrientations / (2 * std::numbers::pi)) *
                             (2 * std::numbers::pi) / RotatedPattern::kOrientations;
    for (const Point& point : points_) {
      const auto u = std::lround(std::cos(angle_rad) * point.x - std::sin(angle_rad) * point.y);
      const auto v = std::lround(std::sin(angle_rad) * point.x + std::cos(angle_rad) * point.y);
      patches.push_back(smoothed.at(x + static_cast<int>(u), y + static_cast<int>(v)));
    }
  }

  ImageView<const std::uint8_t> image() const { return pyramid_.image(0); }

 private:
  const OrbKernels& kernels_;
  std::vector<Point> points_;
  OrbPyramid pyramid_;
};

struct Patches {
  std::vector<std::uint8_t> originals;
  std::vector<std::uint8_t> warped;
};

void append_patches(const cv::Mat& image, cv::RNG& random, Patches& patches) {
  const cv::Point2f centre(static_cast<float>(image.cols) / 2, static_cast<float>(image.rows) / 2);
  const cv::Matx23d warp = cv::getRotationMatrix2D(centre, random.uniform(-25.0, 25.0), random.uniform(0.85, 1.18));
  cv::Mat warped;
  cv::warpAffine(image, warped, warp, image.size(), cv::INTER_LINEAR, cv::BORDER_REFLECT);
  cv::Mat noise(image.size(), CV_16S);
  random.fill(noise, cv::RNG::NORMAL, 0, 4);
  cv::add(warped, noise, warped, cv::noArray(), CV_8U);

  PatchSampler original_sampler(image.cols, image.rows);
  PatchSampler warped_sampler(image.cols, image.rows);
  original_sampler.set_image(image);
  warped_sampler.set_image(warped);
  CornerDetector detector(image.cols, kMargin, 20, 7, orb_kernels(best_simd_level()));
  std::vector<Corner> corners, selected;
  detector.detect(original_sampler.image(), corners);
  CornerQuadtree(image.cols, image.rows, kMargin, kCornersPerImage).select(corners, kCornersPerImage, selected);
  for (const Corner& corner : selected) {
    const cv::Vec2d moved = warp * cv::Vec3d(corner.x, corner.y, 1.0);
    const cv::Rect inside(kMargin, kMargin, image.cols - 2 * kMargin, image.rows - 2 * kMargin);
    const cv::Point target(static_cast<int>(std::lround(moved[0])), static_cast<int>(std::lround(moved[1])));
    if (inside.contains(target)) {
      original_sampler.append(corner.x, corner.y, patches.originals);
      warped_sampler.append(target.x, target.y, patches.warped);
    }
  }
}

struct Candidate {
  std::size_t a, b;                 ///< indices of disc points
  double change_rate = 0;           ///< share of patches on which the answer changes
  std::vector<std::uint64_t> bits;  ///< answers on the originals
};

std::size_t count_ones(const std::vector<std::uint64_t>& bits) {
  std::size_t ones = 0;
  for (const std::uint64_t word : bits) {
    ones += static_cast<std::size_t>(std::popcount(word));
  }
  return ones;
}

std::vector<Candidate> make_candidates(const Patches& patches, std::size_t point_count) {
  const std::size_t patch_count = patches.originals.size() / point_count;
  std::mt19937 random(31);
  std::vector<Candidate> candidates;
  for (int i = 0; i < kCandidates; ++i) {
    Candidate candidate{random() % point_count, random() % point_count, 0, std::vector<std::uint64_t>((patch_count + 63) / 64)};
    if (candidate.a == candidate.b) {
      continue;
    }
    std::size_t changed = 0;
    for (std::size_t patch = 0; patch < patch_count; ++patch) {
      const std::size_t base = patch * point_count;
      const bool before = patches.originals[base + candidate.a] < patches.originals[base + candidate.b];
      const bool after = patches.warped[base + candidate.a] < patches.warped[base + candidate.b];
      candidate.bits[patch / 64] |= static_cast<std::uint64_t>(before) << (patch % 64);
      changed += before != after ? 1 : 0;
    }
    const double share = static_cast<double>(count_ones(candidate.bits)) / static_cast<double>(patch_count);
    if (std::abs(share - 0.5) <= kLargestImbalance) {
      candidate.change_rate = static_cast<double>(changed) / static_cast<double>(patch_count);
      candidates.push_back(std::move(candidate));
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& x, const Candidate& y) { return x.change_rate < y.change_rate; });
  return candidates;
}

// Correlation coefficient of two binary variables.
double correlation(const Candidate& x, const Candidate& y, std::size_t patch_count) {
  std::size_t both = 0;
  for (std::size_t i = 0; i < x.bits.size(); ++i) {
    both += static_cast<std::size_t>(std::popcount(x.bits[i] & y.bits[i]));
  }
  const auto n = static_cast<double>(patch_count);
  const double mean_x = static_cast<double>(count_ones(x.bits)) / n;
  const double mean_y = static_cast<double>(count_ones(y.bits)) / n;
  const double covariance = static_cast<double>(both) / n - mean_x * mean_y;
  return covariance / std::sqrt(mean_x * (1 - mean_x) * mean_y * (1 - mean_y));
}

std::vector<const Candidate*> choose(const std::vector<Candidate>& candidates, std::size_t patch_count) {
  std::vector<const Candidate*> chosen;
  double limit = 0.15;
  for (; chosen.size() < kBriefTests && limit < 1.0; limit += 0.05) {
    chosen.clear();
    for (const Candidate& candidate : candidates) {
      const bool independent = std::all_of(chosen.begin(), chosen.end(), [&](const Candidate* other) {
        return std::abs(correlation(candidate, *other, patch_count)) < limit;
      });
      if (independent) {
        chosen.push_back(&candidate);
      }
      if (chosen.size() == kBriefTests) {
        break;
      }
    }
  }
  std::fprintf(stderr, "%zu tests, correlated by less than %.2f, changing on %.1f %% to %.1f %% of %zu patches\n", chosen.size(),
               limit - 0.05, 100 * chosen.front()->change_rate, 100 * chosen.back()->change_rate, patch_count);
  return chosen;
}

int run(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  cv::RNG random(15);
  Patches patches;
  const std::size_t step = std::max<std::size_t>(files.size() / kImages, 1);
  for (std::size_t i = 0; i < files.size(); i += step) {
    const cv::Mat image = cv::imread(files[i].string(), cv::IMREAD_GRAYSCALE);
    if (!image.empty()) {
      append_patches(image, random, patches);
    }
  }
  const std::vector<Point> points = disc_points();
  const std::size_t patch_count = patches.originals.size() / points.size();
  if (patch_count == 0) {
    std::fprintf(stderr, "%s: no image with corners in it\n", folder.c_str());
    return EXIT_FAILURE;
  }
  const std::vector<Candidate> candidates = make_candidates(patches, points.size());
  const std::vector<const Candidate*> chosen = choose(candidates, patch_count);
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const Point& a = points[chosen[i]->a];
    const Point& b = points[chosen[i]->b];
    std::printf("%s{%d, %d, %d, %d},%s", i % 6 == 0 ? "    " : " ", a.x, a.y, b.x, b.y,
                i % 6 == 5 || i + 1 == chosen.size() ? "\n" : "");
  }
  return chosen.size() == kBriefTests ? EXIT_SUCCESS : EXIT_FAILURE;
}

}  // namespace
}  // namespace posed

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: %s FOLDER_OF_IMAGES > orb_pattern_table.inc\n", argv[0]);
    return EXIT_FAILURE;
  }
  return posed::run(argv[1]);
}
