#include "slam/local_map.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <unordered_map>
#include <unordered_set>

#include "slam/landmark_estimator.h"

namespace posed {

namespace {

std::vector<KeyframeId> select_keyframes(const Map& map, KeyframeId centre_id, std::size_t max_keyframes) {
  struct Ranked {
    KeyframeId id;
    int shared;
    double distance;
  };
  const Keyframe& centre = *map.find_keyframe(centre_id);
  const Se3 T_centre_map = centre.T_map_camera.inverse();
  std::vector<Ranked> ranked;
  for (const auto& [id, keyframe] : map.keyframes()) {
    if (keyframe.map_id == centre.map_id) {
      const auto shared = centre.covisible.find(id);
      ranked.push_back({id,
                        id == centre_id                    ? std::numeric_limits<int>::max()
                        : shared == centre.covisible.end() ? 0
                                                           : shared->second,
                        (T_centre_map * keyframe.T_map_camera).log().norm()});
    }
  }
  const std::size_t count = std::min(ranked.size(), max_keyframes);
  std::partial_sort(
      ranked.begin(), ranked.begin() + static_cast<std::ptrdiff_t>(count), ranked.end(), [](const Ranked& a, const Ranked& b) {
        return a.shared != b.shared ? a.shared > b.shared : a.distance != b.distance ? a.distance < b.distance : a.id > b.id;
      });
  std::vector<KeyframeId> ids;
  for (std::size_t i = 0; i < count; ++i) {
    ids.push_back(ranked[i].id);
  }
  return ids;
}

}  // namespace

LocalMap select_local_map(const Map& map, KeyframeId centre, std::size_t max_keyframes, std::size_t max_landmarks) {
  LocalMap local;
  local.keyframes = select_keyframes(map, centre, max_keyframes);
  std::unordered_set<LandmarkId> seen;
  for (const KeyframeId id : local.keyframes) {
    for (const LandmarkId landmark : map.find_keyframe(id)->landmarks) {
      if (landmark != kNoLandmark && local.landmarks.size() < max_landmarks && seen.insert(landmark).second) {
        local.landmarks.push_back(landmark);
      }
    }
  }
  std::sort(local.landmarks.begin(), local.landmarks.end());
  return local;
}

void write_local_map(const Map& map, const LocalMap& local, std::size_t max_keyframes, MapSnapshot& snapshot) {
  snapshot.landmarks.clear();
  snapshot.anchors.clear();
  std::unordered_map<KeyframeId, std::uint32_t> anchors;  // their indices
  for (const LandmarkId id : local.landmarks) {
    const Landmark& landmark = *map.find_landmark(id);
    const KeyframeId oldest = landmark.oldest_observer();
    const auto [anchor, is_new] = anchors.try_emplace(oldest, static_cast<std::uint32_t>(snapshot.anchors.size()));
    if (is_new) {
      const Keyframe& keyframe = *map.find_keyframe(oldest);
      snapshot.anchors.push_back({keyframe.T_map_camera, keyframe.covariance});
    }
    snapshot.landmarks.push_back(to_snapshot(id, landmark));
    snapshot.landmarks.back().anchor = anchor->second;
  }
  snapshot.keyframes.resize(std::min(local.keyframes.size(), max_keyframes));
  for (std::size_t i = 0; i < snapshot.keyframes.size(); ++i) {
    const Keyframe& keyframe = *map.find_keyframe(local.keyframes[i]);
    SnapshotKeyframe& s = snapshot.keyframes[i];
    s.id = local.keyframes[i];
    s.T_map_camera = keyframe.T_map_camera;
    s.landmarks.clear();
    for (const LandmarkId id : keyframe.landmarks) {
      const auto it = std::lower_bound(local.landmarks.begin(), local.landmarks.end(), id);
      if (id != kNoLandmark && it != local.landmarks.end() && *it == id) {
        s.landmarks.push_back(static_cast<std::uint32_t>(it - local.landmarks.begin()));
      }
    }
  }
}

}  // namespace posed
