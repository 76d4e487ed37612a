#include "slam/local_mapper.h"

#include <algorithm>

#include "slam/local_map.h"

namespace posed {

namespace {

constexpr double kMinDepth_m = 0.05;
constexpr std::uint32_t kPredictedBeforeCull = 4;  // keyframes that should have seen a landmark before it is judged
constexpr double kMinFoundShare = 0.3;
// Where something moved, a landmark that no second keyframe has found by then is taken for a mover's that was missed (the test of
// recent map points of Mur-Artal and Tardos, "ORB-SLAM2", T-RO 2017, which makes it everywhere, and asks for three).
constexpr KeyframeId kConfirmedWithin = 3;
// How a keyframe changes the log-odds of a landmark's being static: seen again where it was; or seen through (the depth sensor errs
// at edges, so one look is not enough).
constexpr float kFoundLogOdds = 0.6F;
constexpr float kRefutedLogOdds = -1.5F;
constexpr float kMostLogOdds = 4.0F;
constexpr float kGoneLogOdds = -1.0F;        // below, it is removed
constexpr int kLeastShared = 15;             // landmarks that make two keyframes neighbours
constexpr std::size_t kNeighbours = 10;      // matched with a new keyframe
constexpr std::size_t kCullNeighbours = 20;  // looked at for redundancy
constexpr double kRedundantShare = 0.9;
constexpr std::size_t kWitnesses = 3;  // other keyframes that make an observation redundant

}  // namespace

LocalMapper::LocalMapper(const TrackerConfig& tracker, const MapperConfig& config, const LandmarkEstimator& estimator, Map& map)
    : close_depth_m_(tracker.close_depth_m),
      config_(config),
      estimator_(estimator),
      map_(map),
      triangulation_(estimator, tracker.close_depth_m),
      fusion_(estimator, tracker),
      adjuster_(estimator) {}

void LocalMapper::insert(const KeyframeRecord& record, std::uint32_t map_id, const Se3& T_map_camera) {
  Keyframe& keyframe = map_.add_keyframe(record);
  keyframe.map_id = map_id;
  keyframe.T_map_camera = T_map_camera;
  extend_observed(record);
  judge_predicted(record);
  remove_unconfirmed(record.id);
  if (record.shows_movers) {
    unconfirmed_.push_back(record.id);
  }
  create_from_depth(record);
  link_to_tree(record);
}

/// The parent is the keyframe that shares most with it; where none shares anything (a map's first keyframe), it is a root.
void LocalMapper::link_to_tree(const KeyframeRecord& record) {
  const std::vector<KeyframeId> best = map_.covisible_keyframes(record.id, 1, 1);
  map_.find_keyframe(record.id)->parent = best.empty() ? kNoKeyframe : best.front();
}

/// Links the record's matches and lets each measurement move its landmark.
void LocalMapper::extend_observed(const KeyframeRecord& record) {
  const Keyframe& keyframe = *map_.find_keyframe(record.id);
  for (std::size_t i = 0; i < record.landmarks.size(); ++i) {
    Landmark* const landmark = record.landmarks[i] == kNoLandmark ? nullptr : map_.find_landmark(record.landmarks[i]);
    if (landmark == nullptr || Map::keypoint_of(*landmark, record.id) >= 0) {
      continue;  // culled or joined with another one since the tracker's snapshot
    }
    const auto keypoint = static_cast<std::uint16_t>(i);
    const LandmarkMeasurement m = estimator_.measure(*landmark, keyframe, keypoint);
    if (LandmarkEstimator::agrees(m)) {
      map_.observe(record.landmarks[i], record.id, keypoint);
      LandmarkEstimator::update(*landmark, m);
      estimator_.renew_appearance(map_, *landmark);
    }
  }
}

/// A landmark that keyframes keep missing where they should see it (noise, a mover, a wrong match) is removed.
void LocalMapper::judge_predicted(const KeyframeRecord& record) {
  const Keyframe& keyframe = *map_.find_keyframe(record.id);
  const LocalMap local = select_local_map(map_, record.id, static_cast<std::size_t>(config_.local_keyframes),
                                          static_cast<std::size_t>(config_.local_landmarks));
  for (const LandmarkId id : local.landmarks) {
    Landmark& landmark = *map_.find_landmark(id);
    const bool found = landmark.observations.back().keyframe == record.id;
    if (found) {
      landmark.static_log_odds = std::min(kMostLogOdds, landmark.static_log_odds + kFoundLogOdds);
    } else if (std::binary_search(record.refuted.begin(), record.refuted.end(), id)) {
      landmark.static_log_odds += kRefutedLogOdds;
      if (landmark.static_log_odds < kGoneLogOdds) {
        map_.remove_landmark(id);
        continue;
      }
    }
    if (!found && (!estimator_.in_view(landmark, keyframe.T_map_camera) ||
                   std::binary_search(record.hidden.begin(), record.hidden.end(), id))) {
      continue;
    }
    ++landmark.predicted;
    landmark.found += found ? 1 : 0;
    if (landmark.predicted >= kPredictedBeforeCull && landmark.found < kMinFoundShare * landmark.predicted) {
      map_.remove_landmark(id);
    }
  }
}

void LocalMapper::remove_unconfirmed(KeyframeId newest) {
  while (!unconfirmed_.empty() && unconfirmed_.front() + kConfirmedWithin <= newest) {
    const Keyframe* const keyframe = map_.find_keyframe(unconfirmed_.front());
    unconfirmed_.pop_front();
    if (keyframe == nullptr) {
      continue;  // dropped since
    }
    const std::vector<LandmarkId> landmarks = keyframe->landmarks;
    for (const LandmarkId id : landmarks) {
      const Landmark* const landmark = id == kNoLandmark ? nullptr : map_.find_landmark(id);
      if (landmark != nullptr && landmark->observations.size() == 1) {
        map_.remove_landmark(id);
      }
    }
  }
}

void LocalMapper::create_from_depth(const KeyframeRecord& record) {
  const Keyframe& keyframe = *map_.find_keyframe(record.id);
  for (std::size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    const double z = keyframe.depth_m[i];
    if (keyframe.landmarks[i] != kNoLandmark || z < kMinDepth_m || z > close_depth_m_) {
      continue;
    }
    const auto keypoint = static_cast<std::uint16_t>(i);
    Landmark landmark;
    landmark.p_map = keyframe.T_map_camera * estimator_.camera().unproject(keyframe.ideal_pixels[i].cast<double>(), z);
    landmark.information = estimator_.measure(landmark, keyframe, keypoint).information;
    landmark.predicted = 1;
    landmark.found = 1;
    const LandmarkId id = map_.add_landmark(std::move(landmark));
    map_.observe(id, record.id, keypoint);
    estimator_.renew_appearance(map_, *map_.find_landmark(id));
  }
}

void LocalMapper::extend(KeyframeId keyframe, const Interrupt& interrupt) {
  std::vector<LandmarkId> nearby;
  for (const KeyframeId neighbour : map_.covisible_keyframes(keyframe, kLeastShared, kNeighbours)) {
    if (is_interrupted(interrupt)) {
      return;
    }
    triangulation_.triangulate_between(map_, keyframe, neighbour);
    const std::vector<LandmarkId> own = map_.find_keyframe(keyframe)->landmarks;
    fusion_.fuse(map_, own, neighbour, {});
    const std::vector<LandmarkId>& theirs = map_.find_keyframe(neighbour)->landmarks;
    nearby.insert(nearby.end(), theirs.begin(), theirs.end());
  }
  std::sort(nearby.begin(), nearby.end());
  nearby.erase(std::unique(nearby.begin(), nearby.end()), nearby.end());
  fusion_.fuse(map_, nearby, keyframe, {});
}

BundleSummary LocalMapper::adjust(KeyframeId keyframe, const Interrupt& interrupt) {
  MapAdjuster::Window window;
  window.free_keyframes = static_cast<std::size_t>(config_.bundle_keyframes);
  window.fixed_keyframes = window.free_keyframes;
  window.iterations = config_.bundle_iterations;
  return adjuster_.adjust_around(map_, keyframe, window, interrupt);
}

double LocalMapper::redundancy(const Keyframe& keyframe) const {
  int judged = 0;
  int redundant = 0;
  for (std::size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    const Landmark* const landmark = keyframe.landmarks[i] == kNoLandmark ? nullptr : map_.find_landmark(keyframe.landmarks[i]);
    if (landmark == nullptr || keyframe.depth_m[i] > close_depth_m_) {
      continue;
    }
    ++judged;
    std::size_t witnesses = 0;
    for (const Observation& o : landmark->observations) {
      const Keyframe& other = *map_.find_keyframe(o.keyframe);
      const int as_fine = keyframe.features.keypoints[i].level + 1;
      witnesses += &other != &keyframe && other.features.keypoints[o.keypoint].level <= as_fine ? 1 : 0;
    }
    redundant += witnesses >= kWitnesses ? 1 : 0;
  }
  return judged == 0 ? 1.0 : static_cast<double>(redundant) / judged;
}

bool LocalMapper::is_redundant(const Keyframe& keyframe) const {
  return redundancy(keyframe) > kRedundantShare;
}

std::vector<KeyframeId> LocalMapper::droppable_keyframes(KeyframeId keyframe, std::size_t kept_newest) const {
  KeyframeId newest_judged = kNoKeyframe;
  if (map_.keyframes().size() > kept_newest) {
    newest_judged = std::prev(map_.keyframes().end(), static_cast<std::ptrdiff_t>(kept_newest) + 1)->first;
  }
  std::vector<KeyframeId> droppable = map_.covisible_keyframes(keyframe, kLeastShared, kCullNeighbours);
  std::erase_if(droppable, [&](KeyframeId id) {
    const Keyframe& candidate = *map_.find_keyframe(id);
    return id > newest_judged || candidate.parent == kNoKeyframe || !candidate.loops.empty();
  });
  return droppable;
}

}  // namespace posed
