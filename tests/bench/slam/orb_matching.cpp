// How well descriptors match between frames of a recording, ours beside OpenCV's ORB on the very same keypoints and orientations.
//
//   orb_matching SEQUENCE [FIRST_FRAME]       (a folder in the TUM RGB-D layout with ground truth)
//
// Frames are paired with those 5, 10 and 20 later. A keypoint with depth is carried over by the ground truth; where a keypoint of
// the same level (or a neighbouring one) lies within 3 pixels of its level, it has a true partner. Mutual nearest neighbours are
// counted.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <opencv2/features2d.hpp>
#include <opencv2/imgcodecs.hpp>

#include "slam/hamming.h"
#include "slam/orb_extractor.h"

namespace posed {
namespace {

// tum_fr1; lens distortion is left out, since it hardly changes over the distance that a point moves between the frames.
constexpr double kFx = 517.3, kFy = 516.5, kCx = 318.6, kCy = 255.3;
constexpr double kDepthUnitsPerM = 5000.0;

struct Frame {
  std::vector<Keypoint> keypoints;
  std::vector<double> depth_m;
  std::vector<Descriptor> ours;
  std::vector<Descriptor> opencv;
  Eigen::Isometry3d T_world_camera;
};

struct Stamped {
  double stamp_s;
  std::string rest;
};

std::vector<Stamped> read_list(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::vector<Stamped> entries;
  for (std::string line; std::getline(in, line);) {
    std::istringstream fields(line);
    Stamped entry;
    if (line.front() != '#' && fields >> entry.stamp_s && std::getline(fields >> std::ws, entry.rest)) {
      entries.push_back(entry);
    }
  }
  return entries;
}

const Stamped& nearest(const std::vector<Stamped>& entries, double stamp_s) {
  return *std::min_element(entries.begin(), entries.end(), [&](const Stamped& a, const Stamped& b) {
    return std::abs(a.stamp_s - stamp_s) < std::abs(b.stamp_s - stamp_s);
  });
}

Eigen::Isometry3d parse_pose(const std::string& text) {
  std::istringstream in(text);
  Eigen::Vector3d t;
  Eigen::Quaterniond q;
  in >> t.x() >> t.y() >> t.z() >> q.x() >> q.y() >> q.z() >> q.w();
  return Eigen::Translation3d(t) * q.normalized();
}

// OpenCV's descriptors at our keypoints; those that lie in its wider border are removed from the frame.
void describe_with_opencv(const cv::Mat& image, Frame& frame) {
  std::vector<cv::KeyPoint> keypoints;
  for (std::size_t i = 0; i < frame.keypoints.size(); ++i) {
    const Keypoint& k = frame.keypoints[i];
    const float scale = std::pow(1.2f, static_cast<float>(k.level));
    // OpenCV lets the centres of the corner pixels of all levels coincide, we the corners themselves.
    const float offset = 0.5f * (1.0f - scale);
    keypoints.emplace_back(k.x + offset, k.y + offset, 31.0f * scale, k.angle_rad * 180.0f / static_cast<float>(CV_PI), k.response,
                           k.level, static_cast<int>(i));
  }
  cv::Mat descriptors;
  cv::ORB::create(1000, 1.2f, 8, 19)->compute(image, keypoints, descriptors);
  Frame kept;
  kept.T_world_camera = frame.T_world_camera;
  for (std::size_t row = 0; row < keypoints.size(); ++row) {
    const auto i = static_cast<std::size_t>(keypoints[row].class_id);
    kept.keypoints.push_back(frame.keypoints[i]);
    kept.depth_m.push_back(frame.depth_m[i]);
    kept.ours.push_back(frame.ours[i]);
    std::copy_n(descriptors.ptr(static_cast<int>(row)), sizeof(Descriptor),
                reinterpret_cast<std::uint8_t*>(kept.opencv.emplace_back().data()));
  }
  frame = std::move(kept);
}

std::vector<Frame> load_frames(const std::filesystem::path& sequence, std::size_t first) {
  const auto colour = read_list(sequence / "rgb.txt");
  const auto depth = read_list(sequence / "depth.txt");
  const auto truth = read_list(sequence / "groundtruth.txt");
  std::vector<Frame> frames;
  for (std::size_t i = first; i < colour.size(); i += 5) {
    const cv::Mat gray = cv::imread((sequence / colour[i].rest).string(), cv::IMREAD_GRAYSCALE);
    const cv::Mat depth_image = cv::imread((sequence / nearest(depth, colour[i].stamp_s).rest).string(), cv::IMREAD_UNCHANGED);
    OrbExtractor extractor({}, gray.cols, gray.rows);
    Features features;
    extractor.extract({gray.data, gray.cols, gray.rows, static_cast<std::ptrdiff_t>(gray.step), 1}, features);
    Frame& frame = frames.emplace_back();
    frame.keypoints = features.keypoints;
    frame.ours = features.descriptors;
    frame.T_world_camera = parse_pose(nearest(truth, colour[i].stamp_s).rest);
    for (const Keypoint& k : frame.keypoints) {
      frame.depth_m.push_back(depth_image.at<std::uint16_t>(static_cast<int>(k.y + 0.5f), static_cast<int>(k.x + 0.5f)) /
                              kDepthUnitsPerM);
    }
    describe_with_opencv(gray, frame);
  }
  return frames;
}

struct Tally {
  long true_pairs = 0;  ///< keypoints that have a partner
  long matches = 0;
  long correct = 0;
};

// Where keypoint `i` of `from` appears in `to`, in pixels; false where it has no depth.
bool carry_over(const Frame& from, std::size_t i, const Frame& to, Eigen::Vector2d& pixel) {
  const double z = from.depth_m[i];
  if (z <= 0) {
    return false;
  }
  const Eigen::Vector3d p_from((from.keypoints[i].x - kCx) / kFx * z, (from.keypoints[i].y - kCy) / kFy * z, z);
  const Eigen::Vector3d p_to = to.T_world_camera.inverse() * from.T_world_camera * p_from;
  pixel = {kFx * p_to.x() / p_to.z() + kCx, kFy * p_to.y() / p_to.z() + kCy};
  return p_to.z() > 0;
}

void tally_pair(const Frame& from, const Frame& to, const std::vector<Descriptor>& from_descriptors,
                const std::vector<Descriptor>& to_descriptors, Tally& tally) {
  const HammingKernels& hamming = hamming_kernels();
  std::vector<std::uint16_t> distances;
  const auto closest = [&](const Descriptor& query, const std::vector<Descriptor>& others) {
    distances.resize(others.size());
    hamming.distances(query, others.data(), static_cast<int>(others.size()), distances.data());
    return static_cast<std::size_t>(std::min_element(distances.begin(), distances.end()) - distances.begin());
  };
  for (std::size_t i = 0; i < from.keypoints.size(); ++i) {
    Eigen::Vector2d expected;
    if (!carry_over(from, i, to, expected)) {
      continue;
    }
    const double tolerance = 3.0 * std::pow(1.2, from.keypoints[i].level);
    const auto is_partner = [&](const Keypoint& k) {
      return std::abs(k.level - from.keypoints[i].level) <= 1 && std::hypot(k.x - expected.x(), k.y - expected.y()) <= tolerance;
    };
    if (std::none_of(to.keypoints.begin(), to.keypoints.end(), is_partner)) {
      continue;
    }
    ++tally.true_pairs;
    const std::size_t j = closest(from_descriptors[i], to_descriptors);
    if (closest(to_descriptors[j], from_descriptors) != i) {
      continue;
    }
    ++tally.matches;
    const Keypoint& k = to.keypoints[j];
    tally.correct += std::hypot(k.x - expected.x(), k.y - expected.y()) <= tolerance ? 1 : 0;
  }
}

void print(const char* name, const Tally& tally) {
  std::printf("  %-8s %7ld with a partner %7ld mutual matches %7ld correct   precision %.3f   recall %.3f\n", name,
              tally.true_pairs, tally.matches, tally.correct,
              static_cast<double>(tally.correct) / static_cast<double>(tally.matches),
              static_cast<double>(tally.correct) / static_cast<double>(tally.true_pairs));
}

}  // namespace
}  // namespace posed

int main(int argc, char** argv) {
  using namespace posed;
  if (argc < 2) {
    std::fprintf(stderr, "usage: %s SEQUENCE [FIRST_FRAME]\n", argv[0]);
    return EXIT_FAILURE;
  }
  const std::vector<Frame> frames = load_frames(argv[1], argc > 2 ? static_cast<std::size_t>(std::atol(argv[2])) : 0);
  for (const std::size_t step : {1u, 2u, 4u}) {
    Tally ours, opencv;
    for (std::size_t i = 0; i + step < frames.size(); i += 2) {
      tally_pair(frames[i], frames[i + step], frames[i].ours, frames[i + step].ours, ours);
      tally_pair(frames[i], frames[i + step], frames[i].opencv, frames[i + step].opencv, opencv);
    }
    std::printf("%zu frames apart:\n", 5 * step);
    print("ours", ours);
    print("OpenCV", opencv);
  }
  return EXIT_SUCCESS;
}
