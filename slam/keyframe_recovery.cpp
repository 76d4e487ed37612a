#include "slam/keyframe_recovery.h"

#include <algorithm>
#include <array>

#include "core/rigid_alignment.h"
#include "slam/hamming.h"
#include "slam/p3p.h"

namespace posed {

namespace {

constexpr int kMaxDistance = 64;  // bits of 256
constexpr double kMaxRatio = 0.85;
constexpr int kRansacRounds = 100;
constexpr double kAgreementBase = 0.03;  // [m] how far matched points may lie apart, plus a share of the depth squared
constexpr double kAgreementGrowth = 0.02;
constexpr double kChi2Seen = 9.21;  // 99 % quantile of the chi-squared distribution with 2 degrees of freedom

using Sample = std::array<std::size_t, 3>;

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
  /// Three different indices; nothing where two of those drawn are the same.
  std::optional<Sample> three_below(std::size_t n) {
    if (n < 3) {
      return std::nullopt;
    }
    const Sample s = {below(n), below(n), below(n)};
    return s[0] == s[1] || s[0] == s[2] || s[1] == s[2] ? std::nullopt : std::optional(s);
  }
};

std::array<Eigen::Vector3d, 3> pick(const std::vector<Eigen::Vector3d>& points, const Sample& sample) {
  return {points[sample[0]], points[sample[1]], points[sample[2]]};
}

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

int KeyframeRecovery::count_seen(const Se3& T_map_camera) const {
  const Se3 T_camera_map = T_map_camera.inverse();
  const Eigen::Matrix3d R_camera_map = T_camera_map.rotation_matrix();
  int seen = 0;
  for (const PoseObservation& o : observations_) {
    const Eigen::Vector3d p_camera = R_camera_map * o.p_map + T_camera_map.translation();
    seen += p_camera.z() > 0 && o.pixel_weight * (camera_.project(p_camera) - o.ideal_pixel).squaredNorm() < kChi2Seen ? 1 : 0;
  }
  return seen;
}

std::optional<Se3> KeyframeRecovery::align_with_depth() const {
  SampleStream stream{p_map_.size()};
  int most = 0;
  std::optional<Se3> best;
  for (int round = 0; round < kRansacRounds; ++round) {
    const std::optional<Sample> sample = stream.three_below(p_map_.size());
    if (!sample) {
      continue;
    }
    const std::array<Eigen::Vector3d, 3> a = pick(p_map_, *sample);
    const std::array<Eigen::Vector3d, 3> b = pick(p_camera_, *sample);
    const Se3 T_map_camera = align_points(a, b);
    const int agreeing = count_agreeing(T_map_camera);
    if (agreeing > most) {
      most = agreeing;
      best = T_map_camera;
    }
  }
  return best;
}

std::optional<Se3> KeyframeRecovery::align_rays() const {
  SampleStream stream{observations_.size()};
  int most = 0;
  std::optional<Se3> best;
  for (int round = 0; round < kRansacRounds; ++round) {
    const std::optional<Sample> sample = stream.three_below(observations_.size());
    if (!sample) {
      continue;
    }
    std::array<Eigen::Vector3d, 3> p_map;
    std::array<Eigen::Vector3d, 3> rays;
    for (std::size_t i = 0; i < 3; ++i) {
      const PoseObservation& o = observations_[(*sample)[i]];
      p_map[i] = o.p_map;
      rays[i] = camera_.unproject(o.ideal_pixel, 1.0).normalized();
    }
    const P3pSolutions solutions = solve_p3p(p_map, rays);
    for (int s = 0; s < solutions.count; ++s) {
      const Se3& T_map_camera = solutions.T_map_camera[static_cast<std::size_t>(s)];
      const int seen = count_seen(T_map_camera);
      if (seen > most) {
        most = seen;
        best = T_map_camera;
      }
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
  // Poses out of points with depth need no other view of them, so they come first where they can.
  const std::optional<Se3> initial = 2 * p_map_.size() >= matches_.size() ? align_with_depth() : align_rays();
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
