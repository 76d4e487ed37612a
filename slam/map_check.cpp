#include "slam/map_check.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <unordered_map>
#include <unordered_set>

#include <fmt/format.h>

namespace posed {

namespace {

constexpr int kMaxSide = 1 << 14;  // pixels
constexpr int kMaxLevels = 32;
constexpr std::size_t kMaxKeypoints = std::numeric_limits<std::uint16_t>::max();  // as Observation counts them

bool is_rigid(const Se3& T) {
  constexpr double kTolerance = 1e-9;
  return T.is_finite() && std::abs(T.rotation().squaredNorm() - 1.0) < kTolerance;
}

bool is_distance(double metres) {
  return std::isfinite(metres) && metres >= 0;
}

bool is_keypoint(const Keypoint& k, const MapHeader& header) {
  const auto inside = [](float position, int size) { return position > -1.0F && position < static_cast<float>(size); };
  return inside(k.x, header.camera.width) && inside(k.y, header.camera.height) && std::abs(k.angle_rad) <= 3.15F &&
         k.level < header.pyramid_levels;
}

/// Of the link from a keypoint of `keyframe` to `landmark`.
std::string broken_link(LandmarkId landmark, const Keyframe& keyframe, const Map& map) {
  const Landmark* const l = map.find_landmark(landmark);
  if (l == nullptr) {
    return fmt::format("landmark {} does not exist", landmark);
  }
  if (!l->observations.empty()) {
    const Keyframe* const other = map.find_keyframe(l->observations.front().keyframe);
    if (other == nullptr || other->map_id != keyframe.map_id) {
      return fmt::format("landmark {} is observed from another map", landmark);
    }
  }
  return {};
}

std::string broken_features(const Keyframe& keyframe, const MapHeader& header) {
  const std::size_t n = keyframe.features.keypoints.size();
  if (n > kMaxKeypoints || keyframe.features.descriptors.size() != n || keyframe.ideal_pixels.size() != n ||
      keyframe.depth_m.size() != n || keyframe.landmarks.size() != n) {
    return fmt::format("{} keypoints, at most {}, with as many descriptors, depths and links", n, kMaxKeypoints);
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (!is_keypoint(keyframe.features.keypoints[i], header) || !is_distance(keyframe.depth_m[i])) {
      return fmt::format("keypoint {} is not possible", i);
    }
  }
  return {};
}

}  // namespace

std::string broken_rule(const MapHeader& header) {
  const CameraIntrinsics& k = header.camera;
  for (const double value : {k.fx, k.fy, k.cx, k.cy, k.k1, k.k2, k.p1, k.p2, k.k3, k.depth_units_per_metre, k.baseline_fx}) {
    if (!std::isfinite(value)) {
      return "a camera whose numbers are not finite";
    }
  }
  if (k.width < 1 || k.height < 1 || k.width > kMaxSide || k.height > kMaxSide || k.fx <= 0 || k.fy <= 0) {
    return "a camera that is not possible";
  }
  if (header.pyramid_levels < 1 || header.pyramid_levels > kMaxLevels || !(header.pyramid_scale > 1.0) ||
      !std::isfinite(header.pyramid_scale)) {
    return "an image pyramid that is not possible";
  }
  return header.active_map <= header.highest_map ? "" : "the active map is not among the maps";
}

std::string broken_rule(LandmarkId id, const Landmark& landmark) {
  constexpr double kLongest = 1.0 + 1e-6;
  if (!landmark.p_map.allFinite() || !landmark.information.allFinite() || !landmark.mean_view_map.allFinite() ||
      landmark.mean_view_map.squaredNorm() > kLongest || !is_distance(landmark.max_distance_m) ||
      !is_distance(landmark.min_distance_m)) {
    return fmt::format("landmark {}: its numbers are not possible", id);
  }
  return {};
}

std::string broken_rule(KeyframeId id, const Keyframe& keyframe, const MapHeader& header, const Map& map) {
  if (keyframe.map_id > header.highest_map) {
    return fmt::format("keyframe {}: is of map {}, the highest is {}", id, keyframe.map_id, header.highest_map);
  }
  if (!is_rigid(keyframe.T_map_camera) || !keyframe.covariance.allFinite()) {
    return fmt::format("keyframe {}: its pose is not possible", id);
  }
  if (const std::string broken = broken_features(keyframe, header); !broken.empty()) {
    return fmt::format("keyframe {}: {}", id, broken);
  }
  std::unordered_set<LandmarkId> seen;
  for (const LandmarkId landmark : keyframe.landmarks) {
    if (landmark == kNoLandmark) {
      continue;
    }
    if (!seen.insert(landmark).second) {
      return fmt::format("keyframe {}: observes landmark {} twice", id, landmark);
    }
    if (const std::string broken = broken_link(landmark, keyframe, map); !broken.empty()) {
      return fmt::format("keyframe {}: {}", id, broken);
    }
  }
  return {};
}

std::string broken_rule(KeyframeId id, const LoopConstraint& loop, const Map& map) {
  if (map.find_keyframe(id) == nullptr || map.find_keyframe(loop.other) == nullptr || loop.other == id) {
    return fmt::format("loop from keyframe {} to {}: one of them does not exist", id, loop.other);
  }
  if (!is_rigid(loop.T_this_other) || !loop.information.allFinite()) {
    return fmt::format("loop from keyframe {} to {}: its numbers are not possible", id, loop.other);
  }
  return {};
}

std::string broken_spanning_tree(const Map& map) {
  std::unordered_map<KeyframeId, KeyframeId> visited_from;  // keyframe: where the walk to the root began that came by
  for (const auto& [id, keyframe] : map.keyframes()) {
    KeyframeId at = id;
    while (at != kNoKeyframe && visited_from.emplace(at, id).second) {
      const Keyframe& k = map.keyframes().at(at);
      const Keyframe* const parent = map.find_keyframe(k.parent);
      if (k.parent != kNoKeyframe && (parent == nullptr || parent->map_id != k.map_id)) {
        return fmt::format("keyframe {}: its parent {} is not in its map", at, k.parent);
      }
      at = k.parent;
    }
    if (at != kNoKeyframe && visited_from.at(at) == id) {
      return fmt::format("keyframe {}: is its own ancestor", at);
    }
  }
  return {};
}

}  // namespace posed
