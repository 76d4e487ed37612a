#include "slam/map_adjuster.h"

#include <algorithm>
#include <map>

namespace posed {

namespace {

constexpr int kLeastShared = 15;  // landmarks that a neighbour must share to be moved along

KeyframeId oldest_of(const Map& map, std::uint32_t map_id) {
  const auto it = std::find_if(map.keyframes().begin(), map.keyframes().end(),
                               [map_id](const auto& entry) { return entry.second.map_id == map_id; });
  return it == map.keyframes().end() ? kNoKeyframe : it->first;
}

}  // namespace

MapAdjuster::MapAdjuster(const LandmarkEstimator& estimator) : estimator_(estimator), adjuster_(estimator.camera()) {}

void MapAdjuster::begin() {
  problem_.clear();
  cameras_.clear();
  camera_of_.clear();
  points_.clear();
  point_of_.clear();
}

void MapAdjuster::add_camera(const Map& map, KeyframeId keyframe, bool fixed) {
  camera_of_.emplace(keyframe, static_cast<std::uint32_t>(cameras_.size()));
  cameras_.push_back(keyframe);
  problem_.cameras.push_back({map.find_keyframe(keyframe)->T_map_camera, fixed});
}

void MapAdjuster::add_landmarks_of(const Map& map, KeyframeId keyframe) {
  for (const LandmarkId id : map.find_keyframe(keyframe)->landmarks) {
    if (id != kNoLandmark && point_of_.emplace(id, static_cast<std::uint32_t>(points_.size())).second) {
      points_.push_back(id);
      problem_.points.push_back({map.find_landmark(id)->p_map});
    }
  }
}

void MapAdjuster::add_observations(const Map& map) {
  const double baseline_fx = estimator_.camera().intrinsics().baseline_fx;
  for (std::size_t p = 0; p < points_.size(); ++p) {
    for (const Observation& o : map.find_landmark(points_[p])->observations) {
      const auto camera = camera_of_.find(o.keyframe);
      if (camera == camera_of_.end()) {
        continue;
      }
      const Keyframe& k = *map.find_keyframe(o.keyframe);
      const int level = k.features.keypoints[o.keypoint].level;
      const double z = k.depth_m[o.keypoint];
      problem_.observations.push_back({camera->second, static_cast<std::uint32_t>(p), k.ideal_pixels[o.keypoint].cast<double>(),
                                       z > 0 ? baseline_fx / z : 0.0, estimator_.noise().pixel_weight(level),
                                       z > 0 ? estimator_.noise().disparity_weight(level, z) : 0.0, true});
    }
  }
}

BundleSummary MapAdjuster::adjust_around(Map& map, KeyframeId centre, const Window& window, const Interrupt& interrupt) {
  begin();
  const KeyframeId oldest = oldest_of(map, map.find_keyframe(centre)->map_id);
  add_camera(map, centre, centre == oldest);
  for (const KeyframeId id : map.covisible_keyframes(centre, kLeastShared, window.free_keyframes - 1)) {
    add_camera(map, id, id == oldest);
  }
  const std::size_t free = cameras_.size();
  for (std::size_t c = 0; c < free; ++c) {
    add_landmarks_of(map, cameras_[c]);
  }
  // Of those that see these landmarks from outside, the ones that see most hold the window in its place.
  std::map<KeyframeId, int> seen_by;
  for (const LandmarkId id : points_) {
    for (const Observation& o : map.find_landmark(id)->observations) {
      if (!camera_of_.contains(o.keyframe)) {
        ++seen_by[o.keyframe];
      }
    }
  }
  std::vector<std::pair<int, KeyframeId>> ranked;
  for (const auto& [id, seen] : seen_by) {
    ranked.emplace_back(seen, id);
  }
  std::sort(ranked.begin(), ranked.end(), std::greater<>());
  ranked.resize(std::min(ranked.size(), window.fixed_keyframes));
  for (const auto& [seen, id] : ranked) {
    add_camera(map, id, true);
  }
  return adjust(map, window.iterations, interrupt);
}

BundleSummary MapAdjuster::adjust_all(Map& map, std::uint32_t map_id, int iterations, const Interrupt& interrupt) {
  begin();
  for (const auto& [id, keyframe] : map.keyframes()) {
    if (keyframe.map_id == map_id) {
      add_camera(map, id, cameras_.empty());
      add_landmarks_of(map, id);
    }
  }
  return adjust(map, iterations, interrupt);
}

BundleSummary MapAdjuster::adjust(Map& map, int iterations, const Interrupt& interrupt) {
  add_observations(map);
  BundleOptions options;
  options.max_iterations = iterations;
  const BundleSummary summary = adjuster_.solve(problem_, options, interrupt);
  if (summary.outcome == BundleOutcome::Degenerate) {
    return summary;
  }
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    map.find_keyframe(cameras_[c])->T_map_camera = problem_.cameras[c].T_map_camera;
  }
  for (std::size_t p = 0; p < points_.size(); ++p) {
    map.find_landmark(points_[p])->p_map = problem_.points[p].p_map;
  }
  for (const BundleObservation& o : problem_.observations) {
    if (!o.inlier && summary.outcome != BundleOutcome::Interrupted) {  // the flags of a half-way state say little
      map.forget_observation(points_[o.point], cameras_[o.camera]);
    }
  }
  for (const LandmarkId id : points_) {
    Landmark* const landmark = map.find_landmark(id);
    if (landmark == nullptr) {
      continue;
    }
    const Observation& newest = landmark->observations.back();
    if (landmark->observations.size() == 1 && map.find_keyframe(newest.keyframe)->depth_m[newest.keypoint] <= 0) {
      map.remove_landmark(id);  // one viewing ray is no place
      continue;
    }
    estimator_.renew_information(map, *landmark);
    estimator_.renew_appearance(map, *landmark);
  }
  return summary;
}

}  // namespace posed
