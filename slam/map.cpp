#include "slam/map.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace posed {

KeyframeId Landmark::oldest_observer() const {
  assert(!observations.empty());
  return std::min_element(observations.begin(), observations.end(),
                          [](const Observation& a, const Observation& b) { return a.keyframe < b.keyframe; })
      ->keyframe;
}

void Landmark::move(const Se3& T_new_old) {
  const Eigen::Matrix3d R_new_old = T_new_old.rotation_matrix();
  p_map = T_new_old * p_map;
  mean_view_map = R_new_old * mean_view_map;
  information = R_new_old * information * R_new_old.transpose();
}

Keyframe& Map::add_keyframe(const KeyframeRecord& record) {
  assert(record.id != kNoKeyframe && !keyframes_.contains(record.id));
  Keyframe& keyframe = keyframes_[record.id];
  keyframe.map_id = record.map_id;
  keyframe.sequence = record.sequence;
  keyframe.capture_ns = record.capture_ns;
  keyframe.T_map_camera = record.T_map_camera;
  keyframe.covariance = record.covariance;
  keyframe.features = record.features;
  keyframe.ideal_pixels = record.ideal_pixels;
  keyframe.depth_m = record.depth_m;
  keyframe.landmarks.assign(record.features.keypoints.size(), kNoLandmark);
  return keyframe;
}

void Map::restore_keyframe(KeyframeId id, Keyframe keyframe) {
  assert(id != kNoKeyframe && !keyframes_.contains(id));
  const std::vector<LandmarkId> links = std::exchange(keyframe.landmarks, {});
  keyframe.landmarks.assign(links.size(), kNoLandmark);
  keyframe.covisible.clear();
  keyframes_.emplace(id, std::move(keyframe));
  for (std::size_t i = 0; i < links.size(); ++i) {
    if (links[i] != kNoLandmark) {
      observe(links[i], id, static_cast<std::uint16_t>(i));
    }
  }
}

LandmarkId Map::add_landmark(Landmark landmark) {
  const LandmarkId id = next_landmark_++;
  landmarks_.emplace(id, std::move(landmark));
  return id;
}

void Map::restore_landmark(LandmarkId id, Landmark landmark) {
  assert(id != kNoLandmark && !landmarks_.contains(id));
  landmark.observations.clear();
  landmarks_.emplace(id, std::move(landmark));
  next_landmark_ = std::max(next_landmark_, id + 1);
}

void Map::restore_next_landmark(LandmarkId next) {
  next_landmark_ = std::max(next_landmark_, next);
}

void Map::change_covisibility(const Landmark& landmark, KeyframeId keyframe, int change) {
  Keyframe& k = keyframes_.at(keyframe);
  const auto add = [change](std::map<KeyframeId, int>& shared, KeyframeId with) {
    const auto it = shared.try_emplace(with, 0).first;
    it->second += change;
    if (it->second == 0) {
      shared.erase(it);
    }
  };
  for (const Observation& o : landmark.observations) {
    if (o.keyframe != keyframe) {
      add(k.covisible, o.keyframe);
      add(keyframes_.at(o.keyframe).covisible, keyframe);
    }
  }
}

void Map::observe(LandmarkId landmark, KeyframeId keyframe, std::uint16_t keypoint) {
  Landmark& l = landmarks_.at(landmark);
  Keyframe& k = keyframes_.at(keyframe);
  assert(k.landmarks[keypoint] == kNoLandmark && keypoint_of(l, keyframe) < 0);
  change_covisibility(l, keyframe, +1);
  k.landmarks[keypoint] = landmark;
  l.observations.push_back({keyframe, keypoint});
}

void Map::forget_observation(LandmarkId landmark, KeyframeId keyframe) {
  const auto it = landmarks_.find(landmark);
  const int keypoint = it == landmarks_.end() ? -1 : keypoint_of(it->second, keyframe);
  if (keypoint < 0) {
    return;
  }
  keyframes_.at(keyframe).landmarks[static_cast<std::size_t>(keypoint)] = kNoLandmark;
  std::erase_if(it->second.observations, [&](const Observation& o) { return o.keyframe == keyframe; });
  change_covisibility(it->second, keyframe, -1);
  if (it->second.observations.empty()) {
    landmarks_.erase(it);
  }
}

void Map::merge_landmarks(LandmarkId duplicate, LandmarkId kept) {
  if (duplicate == kept || !landmarks_.contains(duplicate) || !landmarks_.contains(kept)) {
    return;
  }
  const std::vector<Observation> observations = landmarks_.at(duplicate).observations;
  const std::uint32_t predicted = landmarks_.at(duplicate).predicted;
  const std::uint32_t found = landmarks_.at(duplicate).found;
  remove_landmark(duplicate);
  Landmark& l = landmarks_.at(kept);
  for (const Observation& o : observations) {
    if (keypoint_of(l, o.keyframe) < 0) {
      observe(kept, o.keyframe, o.keypoint);
    }
  }
  l.predicted += predicted;
  l.found += found;
}

void Map::remove_landmark(LandmarkId landmark) {
  const auto it = landmarks_.find(landmark);
  if (it == landmarks_.end()) {
    return;
  }
  std::vector<Observation>& observations = it->second.observations;
  while (!observations.empty()) {
    const Observation last = observations.back();
    keyframes_.at(last.keyframe).landmarks[last.keypoint] = kNoLandmark;
    observations.pop_back();
    change_covisibility(it->second, last.keyframe, -1);
  }
  landmarks_.erase(it);
}

void Map::remove_keyframe(KeyframeId keyframe) {
  const auto it = keyframes_.find(keyframe);
  if (it == keyframes_.end()) {
    return;
  }
  const std::vector<LandmarkId> links = it->second.landmarks;
  for (const LandmarkId id : links) {
    if (id != kNoLandmark) {
      forget_observation(id, keyframe);
    }
  }
  KeyframeId heir = it->second.parent;
  for (auto& [id, k] : keyframes_) {
    if (k.parent == keyframe) {
      k.parent = heir;
      heir = heir == kNoKeyframe ? id : heir;
    }
    std::erase_if(k.loops, [&](const LoopConstraint& loop) { return loop.other == keyframe; });
  }
  keyframes_.erase(it);
}

void Map::join(std::uint32_t from, std::uint32_t to, const Se3& T_to_from) {
  for (auto& [id, k] : keyframes_) {
    if (k.map_id != from) {
      continue;
    }
    for (const LandmarkId landmark : k.landmarks) {
      Landmark* const l = landmark == kNoLandmark ? nullptr : find_landmark(landmark);
      if (l != nullptr && l->oldest_observer() == id) {
        l->move(T_to_from);
      }
    }
    k.T_map_camera = T_to_from * k.T_map_camera;
    k.map_id = to;
  }
}

Landmark* Map::find_landmark(LandmarkId id) {
  const auto it = landmarks_.find(id);
  return it == landmarks_.end() ? nullptr : &it->second;
}

const Landmark* Map::find_landmark(LandmarkId id) const {
  const auto it = landmarks_.find(id);
  return it == landmarks_.end() ? nullptr : &it->second;
}

Keyframe* Map::find_keyframe(KeyframeId id) {
  const auto it = keyframes_.find(id);
  return it == keyframes_.end() ? nullptr : &it->second;
}

const Keyframe* Map::find_keyframe(KeyframeId id) const {
  const auto it = keyframes_.find(id);
  return it == keyframes_.end() ? nullptr : &it->second;
}

bool Map::has_map(std::uint32_t map_id) const {
  return std::any_of(keyframes_.begin(), keyframes_.end(), [map_id](const auto& entry) { return entry.second.map_id == map_id; });
}

int Map::keypoint_of(const Landmark& landmark, KeyframeId keyframe) {
  for (const Observation& o : landmark.observations) {
    if (o.keyframe == keyframe) {
      return o.keypoint;
    }
  }
  return -1;
}

std::vector<KeyframeId> Map::covisible_keyframes(KeyframeId keyframe, int least, std::size_t count) const {
  std::vector<std::pair<int, KeyframeId>> ranked;
  for (const auto& [id, shared] : keyframes_.at(keyframe).covisible) {
    if (shared >= least) {
      ranked.emplace_back(shared, id);
    }
  }
  const auto end = ranked.begin() + static_cast<std::ptrdiff_t>(std::min(count, ranked.size()));
  std::partial_sort(ranked.begin(), end, ranked.end(), std::greater<>());
  std::vector<KeyframeId> ids;
  for (auto it = ranked.begin(); it != end; ++it) {
    ids.push_back(it->second);
  }
  return ids;
}

std::vector<LandmarkId> Map::landmark_ids() const {
  std::vector<LandmarkId> ids;
  ids.reserve(landmarks_.size());
  for (const auto& [id, landmark] : landmarks_) {
    ids.push_back(id);
  }
  std::sort(ids.begin(), ids.end());
  return ids;
}

}  // namespace posed
