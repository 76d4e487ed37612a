#include "slam/loop_closer.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <unordered_map>
#include <utility>

#include "slam/local_map.h"
#include "slam/pose_graph.h"

namespace posed {

namespace {

constexpr std::size_t kCandidates = 3;  // verified for a keyframe
constexpr int kMinInliers = 40;         // landmarks that a match must rest on
constexpr double kMinCovered = 0.1;     // of the image's cells, so that one poster does not make a place
constexpr std::size_t kAgreeing = 3;    // keyframes that must ask for the same correction...
constexpr std::uint64_t kWithin = 6;    // ...among so many in a row
constexpr double kAgreement_m = 0.15;   // how far their corrections may differ
constexpr double kAgreement_rad = 0.07;
constexpr double kDriftFloor_m = 0.2;  // always plausible
constexpr double kDriftFloor_rad = 0.1;
constexpr double kDriftRate_rad_m = 0.05;  // of the path
constexpr double kShortestLoop_m = 1.5;    // path between two keyframes for a loop to be worth closing
constexpr int kLinkShared = 15;            // landmarks that hold two keyframes together
constexpr int kEssentialShared = 100;      // landmarks that make an edge of the essential graph
constexpr int kPoseGraphIterations = 30;
constexpr std::size_t kFusedNeighbours = 10;
constexpr float kFusionRadius = 6.0F;     // [pixels on level 0]: the pose graph leaves more than noise
constexpr double kEdgeSigma_rad = 0.005;  // of a pose relative to a neighbour; all edges alike
constexpr double kEdgeSigma_m = 0.01;

Matrix6d edge_information() {
  Vector6d weights;
  weights.head<3>().setConstant(1.0 / (kEdgeSigma_rad * kEdgeSigma_rad));
  weights.tail<3>().setConstant(1.0 / (kEdgeSigma_m * kEdgeSigma_m));
  return weights.asDiagonal();
}

/// Length of the shortest path [m] from `from` to every keyframe of its map over what holds them together: shared landmarks, the
/// spanning tree, loops closed before. It is along this path that their relative pose drifts, however long the camera has travelled
/// since. Source: Dijkstra, "A note on two problems in connexion with graphs", 1959. Those it does not reach are left out.
std::unordered_map<KeyframeId, double> paths_m(const Map& map, KeyframeId from) {
  std::unordered_map<KeyframeId, std::vector<KeyframeId>> one_way;  // links that only one of the two keyframes knows of
  for (const auto& [id, keyframe] : map.keyframes()) {
    if (keyframe.parent != kNoKeyframe) {
      one_way[keyframe.parent].push_back(id);
      one_way[id].push_back(keyframe.parent);
    }
    for (const LoopConstraint& loop : keyframe.loops) {
      one_way[loop.other].push_back(id);
      one_way[id].push_back(loop.other);
    }
  }
  std::unordered_map<KeyframeId, double> length_m;
  using Reached = std::pair<double, KeyframeId>;
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> front;
  front.emplace(0.0, from);
  while (!front.empty()) {
    const double length = front.top().first;  // no structured binding: clang 14 lets no lambda capture one
    const KeyframeId id = front.top().second;
    front.pop();
    if (!length_m.emplace(id, length).second) {
      continue;
    }
    const Keyframe& keyframe = *map.find_keyframe(id);
    const auto reach = [&](KeyframeId other) {
      if (!length_m.contains(other)) {
        const Se3& T_map_other = map.find_keyframe(other)->T_map_camera;
        front.emplace(length + (T_map_other.translation() - keyframe.T_map_camera.translation()).norm(), other);
      }
    };
    for (const auto& [other, shared] : keyframe.covisible) {
      if (shared >= kLinkShared) {
        reach(other);
      }
    }
    std::for_each(one_way[id].begin(), one_way[id].end(), reach);
  }
  return length_m;
}

/// The spanning tree, loops closed before, and pairs that share much (Mur-Artal, Montiel, Tardos, "ORB-SLAM", T-RO 2015,
/// section III-D), each with the relative pose that the map has now; loops with the one measured.
class EssentialGraph {
 public:
  EssentialGraph(const Map& map, std::uint32_t map_id) {
    for (const auto& [id, keyframe] : map.keyframes()) {
      if (keyframe.map_id == map_id) {
        node_of_.emplace(id, static_cast<std::uint32_t>(nodes_.size()));
        nodes_.push_back(id);
        graph_.nodes.push_back({keyframe.T_map_camera, nodes_.size() == 1});
      }
    }
    for (const KeyframeId id : nodes_) {
      const Keyframe& keyframe = *map.find_keyframe(id);
      for (const auto& [other, shared] : keyframe.covisible) {
        if (other < id && (shared >= kEssentialShared || other == keyframe.parent)) {
          add_present(map, id, other);
        }
      }
      if (keyframe.parent != kNoKeyframe && !keyframe.covisible.contains(keyframe.parent)) {
        add_present(map, id, keyframe.parent);
      }
      for (const LoopConstraint& loop : keyframe.loops) {
        add(id, loop.other, loop.T_this_other, loop.information);
      }
    }
  }

  void add(KeyframeId from, KeyframeId to, const Se3& T_from_to, const Matrix6d& information) {
    graph_.edges.push_back({node_of_.at(from), node_of_.at(to), T_from_to, information});
  }

  PoseGraph& graph() { return graph_; }
  const std::vector<KeyframeId>& nodes() const { return nodes_; }
  const Se3& pose(KeyframeId id) const { return graph_.nodes[node_of_.at(id)].T_map_node; }

 private:
  void add_present(const Map& map, KeyframeId from, KeyframeId to) {
    add(from, to, map.find_keyframe(from)->T_map_camera.inverse() * map.find_keyframe(to)->T_map_camera, edge_information());
  }

  PoseGraph graph_;
  std::vector<KeyframeId> nodes_;
  std::unordered_map<KeyframeId, std::uint32_t> node_of_;
};

/// Moves keyframes to their new poses, and each landmark with the oldest keyframe that sees it.
void move_keyframes(Map& map, const EssentialGraph& solved) {
  for (const LandmarkId id : map.landmark_ids()) {
    Landmark& landmark = *map.find_landmark(id);
    const KeyframeId oldest = landmark.oldest_observer();
    const Keyframe& keyframe = *map.find_keyframe(oldest);
    if (keyframe.map_id == map.find_keyframe(solved.nodes().front())->map_id) {
      landmark.move(solved.pose(oldest) * keyframe.T_map_camera.inverse());
    }
  }
  for (const KeyframeId id : solved.nodes()) {
    map.find_keyframe(id)->T_map_camera = solved.pose(id);
  }
}

}  // namespace

LoopCloser::LoopCloser(const TrackerConfig& tracker, const MapperConfig& config, const LandmarkEstimator& estimator,
                       LocalMapper& mapper, const PlaceRecognizer& places, Map& map)
    : config_(config), estimator_(estimator), mapper_(mapper), map_(map), search_(tracker, estimator.camera(), places, map) {}

Result<std::optional<LoopCorrection>> LoopCloser::close(KeyframeId keyframe) {
  ++keyframes_seen_;
  while (!recent_.empty() && recent_.front().seen + kWithin <= keyframes_seen_) {
    recent_.pop_front();
  }
  const std::optional<Detection> detection = detect(keyframe);
  if (!detection || !is_agreed(*detection)) {
    return std::optional<LoopCorrection>();
  }
  recent_.clear();
  if (detection->matched_map != map_.find_keyframe(keyframe)->map_id) {
    ++counters_.joined;
    return std::optional(join_maps(*detection));
  }
  Result<LoopCorrection> corrected = correct_loop(*detection);
  if (!corrected) {
    return tl::unexpected<Error>(corrected.error());
  }
  ++counters_.closed;
  return std::optional(*corrected);
}

/// The best candidate that geometry confirms and drift explains.
std::optional<LoopCloser::Detection> LoopCloser::detect(KeyframeId keyframe) {
  const Keyframe& k = *map_.find_keyframe(keyframe);
  const std::unordered_map<KeyframeId, double> path_m = paths_m(map_, keyframe);
  const auto path_to = [&](KeyframeId id) {
    const auto path = path_m.find(id);
    return path == path_m.end() ? std::numeric_limits<double>::infinity() : path->second;
  };
  const auto is_elsewhere = [&](KeyframeId id) {
    return id != keyframe && !k.covisible.contains(id) && path_to(id) >= kShortestLoop_m;
  };
  std::optional<Detection> best;
  for (auto& [matched, match] : search_.find(k.features, k.ideal_pixels, k.depth_m, is_elsewhere, {kCandidates, kMinInliers})) {
    if (match.covered < kMinCovered) {
      continue;
    }
    const Keyframe& there = *map_.find_keyframe(matched);
    const Se3 T_keyframe_matched = match.T_map_camera.inverse() * there.T_map_camera;
    Detection detection{keyframe, matched, there.map_id, keyframes_seen_, std::move(match), T_keyframe_matched};
    if (!is_plausible(detection, path_to(matched))) {
      ++counters_.implausible;
      continue;
    }
    if (!best || detection.match.inliers > best->match.inliers) {
      best = std::move(detection);
    }
  }
  return best;
}

/// Rooms that look alike pass every test of appearance and geometry; that the camera should have drifted from one to the other does
/// not. Between maps there is no path, and nothing is known of their distance.
bool LoopCloser::is_plausible(const Detection& detection, double path_m) const {
  const Keyframe& k = *map_.find_keyframe(detection.keyframe);
  if (detection.matched_map != k.map_id) {
    return true;
  }
  const Vector6d asked = (k.T_map_camera.inverse() * detection.match.T_map_camera).log();
  return asked.tail<3>().norm() <= kDriftFloor_m + config_.loop_max_drift * path_m &&
         asked.head<3>().norm() <= kDriftFloor_rad + kDriftRate_rad_m * path_m;
}

/// Whether enough of the last keyframes, this one included, ask for the same correction.
bool LoopCloser::is_agreed(const Detection& detection) {
  const auto correction = [&](const Detection& d) {
    // The keyframe may have been adjusted since: its pose relative to this one counts.
    return d.match.T_map_camera *
           (map_.find_keyframe(d.keyframe)->T_map_camera.inverse() * map_.find_keyframe(detection.keyframe)->T_map_camera);
  };
  std::size_t agreeing = 1;
  for (const Detection& earlier : recent_) {
    if (earlier.matched_map != detection.matched_map || map_.find_keyframe(earlier.keyframe) == nullptr) {
      continue;
    }
    const Vector6d difference = (detection.match.T_map_camera.inverse() * correction(earlier)).log();
    agreeing += difference.tail<3>().norm() < kAgreement_m && difference.head<3>().norm() < kAgreement_rad ? 1 : 0;
  }
  recent_.push_back(detection);
  return agreeing >= kAgreeing;
}

Result<LoopCorrection> LoopCloser::correct_loop(const Detection& detection) {
  Keyframe& k = *map_.find_keyframe(detection.keyframe);
  EssentialGraph essential(map_, k.map_id);
  essential.add(detection.keyframe, detection.matched, detection.T_keyframe_matched, edge_information());
  const Result<PoseGraphSummary> solved = optimize_pose_graph(essential.graph(), kPoseGraphIterations);
  if (!solved) {
    return tl::unexpected<Error>(solved.error());
  }
  const Se3 T_map_camera_before = k.T_map_camera;
  move_keyframes(map_, essential);
  k.loops.push_back({detection.matched, detection.T_keyframe_matched, edge_information()});
  fuse_around(detection);
  const Se3 T_corrected_previous = k.T_map_camera * T_map_camera_before.inverse();
  return LoopCorrection{false, T_corrected_previous, detection.keyframe, detection.matched,
                        (k.T_map_camera.translation() - T_map_camera_before.translation()).norm()};
}

LoopCorrection LoopCloser::join_maps(const Detection& detection) {
  Keyframe& k = *map_.find_keyframe(detection.keyframe);
  const Se3 T_matched_map_own_map = detection.match.T_map_camera * k.T_map_camera.inverse();
  map_.join(k.map_id, detection.matched_map, T_matched_map_own_map);
  k.loops.push_back({detection.matched, detection.T_keyframe_matched, edge_information()});
  fuse_around(detection);
  return LoopCorrection{true, T_matched_map_own_map, detection.keyframe, detection.matched, 0.0};
}

/// Joins what both passes have seen: first what the verification matched, then the neighbourhood of both keyframes.
void LoopCloser::fuse_around(const Detection& detection) {
  for (const auto& [keypoint, landmark] : detection.match.matches) {
    const Landmark* const matched = map_.find_landmark(landmark);
    if (matched == nullptr || Map::keypoint_of(*matched, detection.keyframe) >= 0) {
      continue;
    }
    const LandmarkId present = map_.find_keyframe(detection.keyframe)->landmarks[keypoint];
    if (present == kNoLandmark) {
      map_.observe(landmark, detection.keyframe, keypoint);
    } else {
      map_.merge_landmarks(present, landmark);
    }
    estimator_.renew_appearance(map_, *map_.find_landmark(landmark));
  }
  const LocalMap old_side = search_.surroundings(detection.matched);
  std::vector<KeyframeId> new_side = map_.covisible_keyframes(detection.keyframe, 1, kFusedNeighbours);
  new_side.insert(new_side.begin(), detection.keyframe);
  for (const KeyframeId id : new_side) {
    if (std::find(old_side.keyframes.begin(), old_side.keyframes.end(), id) == old_side.keyframes.end()) {
      mapper_.fusion().fuse(map_, old_side.landmarks, id, {kFusionRadius, false});
    }
  }
}

}  // namespace posed
