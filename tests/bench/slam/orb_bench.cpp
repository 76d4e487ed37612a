// The ORB extractor beside OpenCV's, on the same images in the same run, and its stages one by one. Images: 60 frames spread over
// the recording tum_fr1_xyz in $POSED_TEST_DATA (or ../shared/data), else synthetic texture; the label says which.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <time.h>
#include <vector>

#include <benchmark/benchmark.h>
#include <opencv2/features2d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "slam/hamming.h"
#include "slam/orb_corners.h"
#include "slam/orb_extractor.h"
#include "slam/orb_pattern.h"
#include "slam/orb_pyramid.h"
#include "slam/orb_quadtree.h"

namespace posed {
namespace {

constexpr int kBorder = kPatchRadius + 1;

struct Images {
  std::string origin;
  std::vector<cv::Mat> gray;
};

Images load_images() {
  constexpr std::size_t kFrames = 60;
  const char* folder = std::getenv("POSED_TEST_DATA");
  const std::filesystem::path data =
      folder != nullptr ? std::filesystem::path(folder) : std::filesystem::path(POSED_SOURCE_DIR) / "../shared/data";
  Images images{"tum_fr1_xyz", {}};
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(data / "tum_fr1_xyz/rgb", error)) {
    files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  for (std::size_t i = 0; i < kFrames && !files.empty(); ++i) {
    images.gray.push_back(cv::imread(files[i * files.size() / kFrames].string(), cv::IMREAD_GRAYSCALE));
  }
  if (images.gray.empty()) {
    images.origin = "synthetic texture";
    cv::RNG random(1);
    cv::Mat noise(120, 160, CV_8U);
    random.fill(noise, cv::RNG::UNIFORM, 0, 256);
    cv::resize(noise, images.gray.emplace_back(), {640, 480}, 0, 0, cv::INTER_CUBIC);
  }
  return images;
}

const Images& test_images() {
  static const Images images = load_images();
  return images;
}

ImageView<const std::uint8_t> view(const cv::Mat& image) {
  return {image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step), 1};
}

// Goes round the images, one each iteration; the processor's kernels of level `state.range(0)`.
SimdLevel level_of(benchmark::State& state) {
  const auto levels = supported_simd_levels();
  const auto level = static_cast<SimdLevel>(state.range(0));
  if (std::find(levels.begin(), levels.end(), level) == levels.end()) {
    state.SkipWithError("not on this processor");
    return SimdLevel::Baseline;
  }
  state.SetLabel(to_string(level));
  return level;
}

void BM_Extract(benchmark::State& state) {
  const auto& images = test_images().gray;
  OrbExtractor extractor({}, images[0].cols, images[0].rows, level_of(state));
  Features features;
  std::size_t i = 0;
  for (auto _ : state) {
    extractor.extract(view(images[i++ % images.size()]), features);
    benchmark::DoNotOptimize(features.descriptors.data());
  }
  state.counters["features"] = static_cast<double>(features.keypoints.size());
}
BENCHMARK(BM_Extract)->DenseRange(0, 2)->Unit(benchmark::kMillisecond);

void BM_ExtractOpenCv(benchmark::State& state) {
  cv::setNumThreads(1);
  const auto& images = test_images().gray;
  const auto orb = cv::ORB::create(1000, 1.2f, 8);
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  std::size_t i = 0;
  for (auto _ : state) {
    orb->detectAndCompute(images[i++ % images.size()], cv::noArray(), keypoints, descriptors);
  }
  state.counters["features"] = static_cast<double>(keypoints.size());
}
BENCHMARK(BM_ExtractOpenCv)->Unit(benchmark::kMillisecond);

// Processor time of this thread, to which other programs add nothing but cache misses.
double thread_cpu_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

// Ours and OpenCV's turn by turn on each image, so that neither is favoured by what else the machine does.
void BM_RatioToOpenCv(benchmark::State& state) {
  cv::setNumThreads(1);
  const auto& images = test_images().gray;
  const auto orb = cv::ORB::create(1000, 1.2f, 8);
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  OrbExtractor extractor({}, images[0].cols, images[0].rows);
  Features features;
  std::vector<double> ratios, ours_ms, opencv_ms;
  std::size_t i = 0;
  for (auto _ : state) {
    const cv::Mat& image = images[i++ % images.size()];
    const double start_ms = thread_cpu_ms();
    extractor.extract(view(image), features);
    const double middle_ms = thread_cpu_ms();
    orb->detectAndCompute(image, cv::noArray(), keypoints, descriptors);
    const double end_ms = thread_cpu_ms();
    ours_ms.push_back(middle_ms - start_ms);
    opencv_ms.push_back(end_ms - middle_ms);
    ratios.push_back(ours_ms.back() / opencv_ms.back());
  }
  const auto median = [](std::vector<double>& values) {
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    return values[values.size() / 2];
  };
  state.counters["median_ratio"] = median(ratios);
  state.counters["median_ours_ms"] = median(ours_ms);
  state.counters["median_opencv_ms"] = median(opencv_ms);
  state.SetLabel(test_images().origin);
}
BENCHMARK(BM_RatioToOpenCv)->Iterations(240)->Unit(benchmark::kMillisecond);

// --- Stages, each over all levels of one image
// --------------------------------------------------------------------------------------

struct Stages {
  explicit Stages(SimdLevel simd_level)
      : kernels(orb_kernels(simd_level)),
        image(test_images().gray[test_images().gray.size() / 2]),
        pyramid(image.cols, image.rows, 8, 1.2, 2 * kBorder + 1, kernels),
        detector(image.cols, kBorder, 20, 7, kernels),
        corners(static_cast<std::size_t>(pyramid.level_count())),
        selected(corners.size()) {
    build();
    double quota = 217;
    for (int level = 0; level < pyramid.level_count(); ++level, quota /= 1.2) {
      const auto i = static_cast<std::size_t>(level);
      const auto plane = pyramid.image(level);
      corners[i].reserve(CornerDetector::max_corners(plane.width, plane.height));
      detector.detect(plane, corners[i]);
      pyramid.smooth(level);
      quotas.push_back(static_cast<int>(quota));
      trees.emplace_back(plane.width, plane.height, kBorder, quotas.back());
      trees.back().select(corners[i], quotas.back(), selected[i]);
    }
  }

  void build() {
    pyramid.set_image(view(image));
    for (int level = 1; level < pyramid.level_count(); ++level) {
      pyramid.resize_to(level);
    }
  }

  const OrbKernels& kernels;
  cv::Mat image;
  OrbPyramid pyramid;
  CornerDetector detector;
  std::vector<std::vector<Corner>> corners;
  std::vector<std::vector<Corner>> selected;
  std::vector<CornerQuadtree> trees;
  std::vector<int> quotas;
};

void BM_Pyramid(benchmark::State& state) {
  Stages stages(level_of(state));
  for (auto _ : state) {
    stages.build();
  }
}
BENCHMARK(BM_Pyramid)->DenseRange(0, 2)->Unit(benchmark::kMicrosecond);

void BM_Corners(benchmark::State& state) {
  Stages stages(level_of(state));
  std::size_t found = 0;
  for (auto _ : state) {
    found = 0;
    for (int level = 0; level < stages.pyramid.level_count(); ++level) {
      auto& corners = stages.corners[static_cast<std::size_t>(level)];
      stages.detector.detect(stages.pyramid.image(level), corners);
      found += corners.size();
    }
  }
  state.counters["corners"] = static_cast<double>(found);
}
BENCHMARK(BM_Corners)->DenseRange(0, 2)->Unit(benchmark::kMicrosecond);

void BM_Quadtree(benchmark::State& state) {
  Stages stages(best_simd_level());
  for (auto _ : state) {
    for (std::size_t level = 0; level < stages.corners.size(); ++level) {
      stages.trees[level].select(stages.corners[level], stages.quotas[level], stages.selected[level]);
    }
  }
}
BENCHMARK(BM_Quadtree)->Unit(benchmark::kMicrosecond);

void BM_Smoothing(benchmark::State& state) {
  Stages stages(level_of(state));
  for (auto _ : state) {
    for (int level = 0; level < stages.pyramid.level_count(); ++level) {
      stages.pyramid.smooth(level);
    }
  }
}
BENCHMARK(BM_Smoothing)->DenseRange(0, 2)->Unit(benchmark::kMicrosecond);

void BM_Orientation(benchmark::State& state) {
  Stages stages(level_of(state));
  for (auto _ : state) {
    for (int level = 0; level < stages.pyramid.level_count(); ++level) {
      const auto image = stages.pyramid.image(level);
      for (const Corner& corner : stages.selected[static_cast<std::size_t>(level)]) {
        int m10 = 0;
        int m01 = 0;
        stages.kernels.moments(&image.at(corner.x, corner.y), image.stride, &m10, &m01);
        benchmark::DoNotOptimize(orientation_rad(m10, m01));
      }
    }
  }
}
BENCHMARK(BM_Orientation)->DenseRange(0, 2)->Unit(benchmark::kMicrosecond);

void BM_Description(benchmark::State& state) {
  Stages stages(level_of(state));
  const RotatedPattern pattern(stages.pyramid.stride());
  Descriptor descriptor;
  float angle_rad = -3;
  for (auto _ : state) {
    for (int level = 0; level < stages.pyramid.level_count(); ++level) {
      const auto image = stages.pyramid.smoothed(level);
      for (const Corner& corner : stages.selected[static_cast<std::size_t>(level)]) {
        angle_rad = angle_rad > 2 ? angle_rad - 4 : angle_rad + 1;
        stages.kernels.describe(&image.at(corner.x, corner.y), pattern.offsets(angle_rad), descriptor.data());
        benchmark::DoNotOptimize(descriptor);
      }
    }
  }
}
BENCHMARK(BM_Description)->DenseRange(0, 2)->Unit(benchmark::kMicrosecond);

void BM_HammingIndexed(benchmark::State& state) {
  const HammingKernels& kernels = hamming_kernels(level_of(state));
  std::vector<Descriptor> descriptors(1000);
  std::vector<std::uint16_t> indices(1000), distances(1000);
  for (std::size_t i = 0; i < descriptors.size(); ++i) {
    descriptors[i] = {i * 0x9e3779b97f4a7c15u, i * 0xbf58476d1ce4e5b9u, i * 0x94d049bb133111ebu, i};
    indices[i] = static_cast<std::uint16_t>(i * 7 % 1000);
  }
  for (auto _ : state) {
    kernels.distances_indexed(descriptors[3], descriptors.data(), indices.data(), 1000, distances.data());
    benchmark::DoNotOptimize(distances.data());
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * 1000);
}
BENCHMARK(BM_HammingIndexed)->DenseRange(0, 2);

}  // namespace
}  // namespace posed
