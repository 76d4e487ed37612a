#include "slam/projection_matcher.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "slam/hamming.h"

namespace posed {

namespace {

constexpr float kMinDepth = 0.05F;        // [m]
constexpr float kMinViewCosine = 0.5F;    // 60 degrees off the mean view a patch has changed too much
constexpr float kScaleRangeSlack = 1.2F;  // a landmark is looked for a little beyond the scales it was seen at
constexpr std::uint16_t kNoDistance = std::numeric_limits<std::uint16_t>::max();

}  // namespace

ProjectionMatcher::ProjectionMatcher(const PinholeCamera& camera, const TrackerConfig& config) : camera_(camera) {
  float scale = 1.0F;
  for (int level = 0; level < config.pyramid_levels; ++level) {
    scale_.push_back(scale);
    scale *= static_cast<float>(config.pyramid_scale);
  }
  const auto features = feature_capacity(config.features);
  nearby_.reserve(features);
  distances_.reserve(features);
  new_distance_.reserve(features);
  wanted_.reserve(features);
}

bool ProjectionMatcher::project(const MapSnapshot& map, std::uint32_t landmark, const Eigen::Matrix3f& R_camera_map,
                                const Eigen::Vector3f& t_camera_map, const FeatureFrame& frame,
                                ProjectedLandmark& projected) const {
  const SnapshotLandmark& l = map.landmarks[landmark];
  const Eigen::Vector3f p = R_camera_map * l.p_map + t_camera_map;
  if (p.z() < kMinDepth) {
    return false;
  }
  const CameraIntrinsics& k = camera_.intrinsics();
  const float inverse_z = 1.0F / p.z();
  const float u = static_cast<float>(k.fx) * p.x() * inverse_z + static_cast<float>(k.cx);
  const float v = static_cast<float>(k.fy) * p.y() * inverse_z + static_cast<float>(k.cy);
  if (!frame.in_view(u, v)) {
    return false;
  }
  const float distance = p.norm();
  if (distance > kScaleRangeSlack * l.max_distance_m || kScaleRangeSlack * distance < l.min_distance_m) {
    return false;
  }
  const float view_cosine = p.dot(R_camera_map * l.mean_view_map) / distance;
  if (view_cosine < kMinViewCosine) {
    return false;
  }
  int level = 0;
  while (level + 1 < static_cast<int>(scale_.size()) && scale_[static_cast<std::size_t>(level)] * distance < l.max_distance_m) {
    ++level;
  }
  projected = {landmark, u, v, static_cast<float>(k.baseline_fx) * inverse_z, view_cosine, level};
  return true;
}

ProjectionMatcher::Candidate ProjectionMatcher::best_candidate(const SnapshotLandmark& landmark, const ProjectedLandmark& p,
                                                               const FeatureFrame& frame, const MatchOptions& options,
                                                               const std::vector<std::int32_t>& landmark_of) {
  const float radius = options.radius * scale_[static_cast<std::size_t>(p.level)];
  const std::span<const std::uint16_t> found = frame.search(p.u, p.v, radius, p.level - 1, p.level + 1, nearby_);
  // Keypoints that are taken, or whose depth contradicts the prediction, are no candidates; `found` lies in nearby_, so thin it
  // there.
  std::size_t kept = 0;
  for (const std::uint16_t i : found) {
    const float disparity = frame.disparity()[i];
    if (landmark_of[i] == kUnmatched && (disparity == 0 || std::abs(disparity - p.disparity) <= radius)) {
      nearby_[kept++] = i;
    }
  }
  if (kept == 0) {
    return {};
  }
  distances_.resize(kept);
  hamming_kernels().distances_indexed(landmark.descriptor, frame.features().descriptors.data(), nearby_.data(),
                                      static_cast<int>(kept), distances_.data());
  std::size_t best = 0;
  int second_distance = std::numeric_limits<int>::max();
  std::size_t second = kept;
  for (std::size_t j = 1; j < kept; ++j) {
    if (distances_[j] < distances_[best]) {
      second = best;
      second_distance = distances_[best];
      best = j;
    } else if (distances_[j] < second_distance) {
      second = j;
      second_distance = distances_[j];
    }
  }
  const int best_distance = distances_[best];
  if (best_distance > options.max_distance) {
    return {};
  }
  // On neighbouring levels the same corner appears twice: only rivals on the same level make a match ambiguous.
  const auto& keypoints = frame.features().keypoints;
  if (second < kept && keypoints[nearby_[second]].level == keypoints[nearby_[best]].level &&
      static_cast<float>(best_distance) > options.max_ratio * static_cast<float>(second_distance)) {
    return {};
  }
  return {nearby_[best], best_distance};
}

int ProjectionMatcher::match(const MapSnapshot& map, std::span<const ProjectedLandmark> projected, const FeatureFrame& frame,
                             const MatchOptions& options, std::vector<std::int32_t>& landmark_of) {
  new_distance_.assign(frame.size(), kNoDistance);
  wanted_.assign(frame.size(), kUnmatched);
  for (const ProjectedLandmark& p : projected) {
    const Candidate c = best_candidate(map.landmarks[p.landmark], p, frame, options, landmark_of);
    if (c.keypoint == kUnmatched) {
      continue;
    }
    const auto i = static_cast<std::size_t>(c.keypoint);
    if (c.distance < new_distance_[i]) {
      new_distance_[i] = static_cast<std::uint16_t>(c.distance);
      wanted_[i] = static_cast<std::int32_t>(p.landmark);
    }
  }
  int matches = 0;
  for (std::size_t i = 0; i < wanted_.size(); ++i) {
    if (wanted_[i] != kUnmatched) {
      landmark_of[i] = wanted_[i];
      ++matches;
    }
  }
  return matches;
}

}  // namespace posed
