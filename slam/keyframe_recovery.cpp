#include "slam/keyframe_recovery.h"

#include <algorithm>
#include <array>

#include "core/rigid_alignment.h"
#include "slam/hamming.h"

namespace posed {

namespace {

constexpr int kMaxDistance = 64;  // bits of 256
constexpr double kMaxRatio = 0.85;
constexpr int kRansacRounds = 100;
constexpr double kAgreementBase = 0.03;  // [m] how far matched points may lie apart, plus a share of the depth squared
constexpr double kAgreementGrowth = 0.02;

/// Splitmix64 (Steele, Lea, Flood, OOPSLA 2014): enough for picking samples, and the same everywhere.
struct SampleStream {
  std::uint64_t state;
  std::size_t below(std::size_t n) {
    state += 0x9E3779B97F4A7C15ULL;
    std::uint64_t z = state;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
    return static_cast<std::size_t>((z ^ (z >> 31)) % n);
  }
};

}  // namespace

KeyframeRecovery::KeyframeRecovery(const PinholeCamera& camera, const TrackerConfig& config)
    : camera_(camera), noise_(config, camera.intrinsics()) {
  const auto features = feature_capacity(config.features);
  matches_.reserve(features);
  match_of_keypoint_.reserve(features);
  distances_.reserve(features);
  p_map_.reserve(features);
  p_camera_.reserve(features);
  observations_.reserve(features);
}

void KeyframeRecovery::match_descriptors(const MapSnapshot& map, const SnapshotKeyframe& keyframe, const FeatureFrame& frame) {
  matches_.clear();
  match_of_keypoint_.assign(frame.size(), -1);
  distances_.resize(frame.size());
  for (const std::uint32_t landmark : keyframe.landmarks) {
    hamming_kernels().distances(map.landmarks[landmark].descriptor, frame.features().descriptors.data(),
                                static_cast<int>(frame.size()), distances_.data());
    std::size_t best = 0;
    std::uint16_t second_distance = 256;
    for (std::size_t i = 1; i < distances_.size(); ++i) {
      if (distances_[i] < distances_[best]) {
        second_distance = distances_[best];
        best = i;
      } else if (distances_[i] < second_distance) {
        second_distance = distances_[i];
      }
    }
    if (distances_[best] > kMaxDistance || distances_[best] > kMaxRatio * second_distance) {
      continue;
    }
    std::int32_t& match = match_of_keypoint_[best];
    if (match < 0) {
      match = static_cast<std::int32_t>(matches_.size());
      matches_.push_back({landmark, static_cast<std::uint16_t>(best), distances_[best]});
    } else if (distances_[best] < matches_[static_cast<std::size_t>(match)].distance) {
      matches_[static_cast<std::size_t>(match)] = {landmark, static_cast<std::uint16_t>(best), distances_[best]};
    }
  }
}

int KeyframeRecovery::count_agreeing(const Se3& T_map_camera) const {
  int agreeing = 0;
  for (std::size_t i = 0; i < p_map_.size(); ++i) {
    const double z = p_camera_[i].z();
    const double limit = kAgreementBase + kAgreementGrowth * z * z;
    agreeing += (T_map_camera * p_camera_[i] - p_map_[i]).squaredNorm() < limit * limit ? 1 : 0;
  }
  return agreeing;
}

std::optional<Se3> KeyframeRecovery::ransac() {
  const std::size_t n = p_map_.size();
  if (n < 3) {
    return std::nullopt;
  }
  SampleStream stream{n};
  int most = 0;
  std::optional<Se3> best;
  for (int round = 0; round < kRansacRounds; ++round) {
    const std::array<std::size_t, 3> sample = {stream.below(n), stream.below(n), stream.below(n)};
    if (sample[0] == sample[1] || sample[0] == sample[2] || sample[1] == sample[2]) {
      continue;
    }
    const std::array<Eigen::Vector3d, 3> a = {p_map_[sample[0]], p_map_[sample[1]], p_map_[sample[2]]};
    const std::array<Eigen::Vector3d, 3> b = {p_camera_[sample[0]], p_camera_[sample[1]], p_camera_[sample[2]]};
    const Se3 T_map_camera = align_points(a, b);
    const int agreeing = count_agreeing(T_map_camera);
    if (agreeing > most) {
      most = agreeing;
      best = T_map_camera;
    }
  }
  return best;
}

std::optional<KeyframeRecovery::Recovered> KeyframeRecovery::recover(const MapSnapshot& map, const SnapshotKeyframe& keyframe,
                                                                     const FeatureFrame& frame, int min_inliers) {
  if (frame.size() == 0) {
    return std::nullopt;
  }
  match_descriptors(map, keyframe, frame);
  if (matches_.size() < static_cast<std::size_t>(min_inliers)) {
    return std::nullopt;
  }
  p_map_.clear();
  p_camera_.clear();
  observations_.clear();
  for (const Match& m : matches_) {
    const Eigen::Vector3d p_map = map.landmarks[m.landmark].p_map.cast<double>();
    const Eigen::Vector2d pixel = frame.ideal_pixels()[m.keypoint].cast<double>();
    const double z = frame.depth_m()[m.keypoint];
    const int level = frame.features().keypoints[m.keypoint].level;
    if (z > 0) {
      p_map_.push_back(p_map);
      p_camera_.push_back(camera_.unproject(pixel, z));
    }
    observations_.push_back({p_map, pixel, frame.disparity()[m.keypoint], noise_.pixel_weight(level),
                             z > 0 ? noise_.disparity_weight(level, z) : 0.0, true});
  }
  const std::optional<Se3> initial = ransac();
  if (!initial) {
    return std::nullopt;
  }
  const PoseSolution solution = solve_pose(camera_, *initial, observations_);
  if (!solution.solved || solution.inliers < min_inliers) {
    return std::nullopt;
  }
  return Recovered{solution.T_map_camera, solution.inliers};
}

}  // namespace posed
