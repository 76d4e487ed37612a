#include "slam/mapper.h"

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "core/clock.h"
#include "core/logging.h"
#include "slam/drift_model.h"
#include "slam/dropped_keyframes.h"
#include "slam/landmark_estimator.h"
#include "slam/local_map.h"
#include "slam/local_mapper.h"
#include "slam/loop_closer.h"
#include "slam/map.h"
#include "slam/map_budget.h"
#include "slam/map_io.h"
#include "slam/place_recognizer.h"
#include "slam/relocalizer.h"

namespace posed {

namespace {

constexpr std::size_t kYoungMapKeyframes = 5;  // a map that is left with fewer is not worth keeping
constexpr std::size_t kKeptNewest = 3;         // keyframes not judged redundant yet
constexpr int kFullIterations = 10;            // a round

/// Interrupts when asked to, or after `budget_s`; never where nobody asks (lockstep).
Interrupt within(const Interrupt& interrupt, double budget_s) {
  if (!interrupt) {
    return {};
  }
  const TimeNs deadline_ns = SystemClock::instance().now_ns() + from_seconds(budget_s);
  return [interrupt, deadline_ns] { return interrupt() || SystemClock::instance().now_ns() >= deadline_ns; };
}

}  // namespace

struct Mapper::Impl {
  Impl(const TrackerConfig& tracker, const MapperConfig& mapper, MapMode map_mode, const CameraIntrinsics& intrinsics)
      : tracker_config(tracker),
        config(mapper),
        mode(map_mode),
        estimator(tracker, intrinsics),
        local(tracker, mapper, estimator, map),
        loops(tracker, mapper, estimator, local, places, map),
        relocalizer(tracker, estimator.camera(), places, map),
        budget(mapper, local, map) {}

  void insert(const KeyframeRecord& record);
  void begin_map(const KeyframeRecord& record);
  void insert_keyframe(const KeyframeRecord& record);
  void visit(const KeyframeRecord& record);
  void answer(const KeyframeRecord& record);
  Matrix6d inherited_covariance(const KeyframeRecord& record) const;

  bool improve(const Interrupt& interrupt);
  void adjust_locally(const Interrupt& interrupt);
  void close_loop();
  void adjust_all(const Interrupt& interrupt);
  void cull();
  void keep_budget();
  void drop(KeyframeId id);
  void follow_newest(const Se3& T_map_camera_before);
  void write_snapshot(MapSnapshot& snapshot) const;
  MapHeader header() const;
  Status load(const std::string& path);

  TrackerConfig tracker_config;
  MapperConfig config;
  MapMode mode;
  Map map;
  LandmarkEstimator estimator;
  PlaceRecognizer places;
  LocalMapper local;
  LoopCloser loops;
  Relocalizer relocalizer;
  MapBudget budget;
  DroppedKeyframes dropped;

  std::uint64_t version = 0;
  std::uint32_t newest_map_id = 0;
  KeyframeId newest = kNoKeyframe;       // last one taken in
  KeyframeId newest_seen = kNoKeyframe;  // last one handed over, visits of a map that stays as it is included
  KeyframeId centre = kNoKeyframe;       // of the local map
  Se3 T_map_odom;
  RelocalizationAnswer relocalization;
  MapperCounters counters;

  /// What is left to do after the last keyframe, in this order.
  struct Pending {
    bool extend = false;  // landmarks from the neighbours
    bool adjust = false;  // the neighbourhood
    bool close_loop = false;
    bool adjust_all = false;  // the whole map
  } pending;
};

void Mapper::Impl::insert(const KeyframeRecord& record) {
  ++version;
  if (record.purpose == RecordPurpose::Relocalization) {
    answer(record);
    return;
  }
  newest_seen = record.id;
  if (mode == MapMode::Localization) {
    visit(record);
    return;
  }
  if (record.starts_map) {
    begin_map(record);
  }
  insert_keyframe(record);
}

void Mapper::Impl::begin_map(const KeyframeRecord& record) {
  std::vector<KeyframeId> left;
  const std::uint32_t left_map = newest == kNoKeyframe ? 0 : map.find_keyframe(newest)->map_id;
  for (const auto& [id, keyframe] : map.keyframes()) {
    if (keyframe.map_id == left_map) {
      left.push_back(id);
    }
  }
  if (left.size() < kYoungMapKeyframes) {
    for (const KeyframeId id : left) {
      dropped.remember_fixed(id, map.find_keyframe(id)->T_map_camera);
      places.remove(id);
      map.remove_keyframe(id);
    }
  }
  newest = kNoKeyframe;
  newest_map_id = std::max(newest_map_id, record.map_id);
  T_map_odom = Se3();
  pending.adjust_all = false;
}

void Mapper::Impl::insert_keyframe(const KeyframeRecord& record) {
  // The map may have been corrected, or joined with another, since the snapshot that the tracker used.
  const bool is_joined = !record.starts_map && !map.has_map(record.map_id);
  local.insert(record, is_joined ? map.find_keyframe(newest)->map_id : record.map_id,
               T_map_odom * record.T_map_odom.inverse() * record.T_map_camera);
  newest = record.id;
  centre = record.id;
  map.find_keyframe(newest)->covariance = inherited_covariance(record);
  places.add(record.id, record.features.descriptors);
  keep_budget();
  pending.extend = true;
  pending.adjust = config.bundle_keyframes > 0;
  pending.close_loop = config.loop_closing;
}

/// Of the newest keyframe, by the landmarks that were there before it.
Matrix6d Mapper::Impl::inherited_covariance(const KeyframeRecord& record) const {
  const Keyframe& keyframe = *map.find_keyframe(newest);
  std::map<KeyframeId, int> anchors;  // landmarks seen of each
  for (const LandmarkId id : keyframe.landmarks) {
    if (id != kNoLandmark) {
      ++anchors[map.find_landmark(id)->oldest_observer()];
    }
  }
  anchors.erase(newest);
  InheritedDrift inherited;
  for (const auto& [id, landmarks] : anchors) {
    const Keyframe& anchor = *map.find_keyframe(id);
    inherited.add(landmarks, anchor.T_map_camera.inverse() * keyframe.T_map_camera, anchor.covariance);
  }
  return inherited.covariance(config.drift_factor * record.covariance);
}

/// The map stays as it is; only what is shown of it follows the camera.
void Mapper::Impl::visit(const KeyframeRecord& record) {
  std::map<KeyframeId, int> seen_by;
  for (const LandmarkId id : record.landmarks) {
    if (const Landmark* const landmark = id == kNoLandmark ? nullptr : map.find_landmark(id)) {
      for (const Observation& o : landmark->observations) {
        ++seen_by[o.keyframe];
      }
    }
  }
  const auto best =
      std::max_element(seen_by.begin(), seen_by.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  if (best != seen_by.end()) {
    centre = best->first;
  }
  dropped.remember_fixed(record.id, record.T_map_camera);
}

void Mapper::Impl::answer(const KeyframeRecord& record) {
  ++counters.relocalizations_asked;
  relocalization = {record.sequence, true, false, Se3()};
  const auto found = relocalizer.find(record);
  if (!found) {
    return;
  }
  ++counters.relocalizations_found;
  relocalization.found = true;
  relocalization.T_map_camera = found->T_map_camera;
  centre = found->keyframe;
  newest = centre;  // keyframes that follow belong to its map
}

bool Mapper::Impl::improve(const Interrupt& interrupt) {
  if (map.keyframes().empty() || mode == MapMode::Localization) {
    return false;
  }
  if (std::exchange(pending.extend, false)) {
    local.extend(newest, interrupt);
  } else if (std::exchange(pending.adjust, false)) {
    adjust_locally(interrupt);
    cull();
  } else if (std::exchange(pending.close_loop, false)) {
    close_loop();
  } else if (pending.adjust_all) {
    adjust_all(interrupt);
    if (is_interrupted(interrupt)) {
      ++version;
      return false;
    }
  } else {
    return false;
  }
  ++version;
  return true;
}

/// Moves odom along with the newest keyframe, so that a correction of the map does not make the camera jump in odom.
void Mapper::Impl::follow_newest(const Se3& T_map_camera_before) {
  T_map_odom = map.find_keyframe(newest)->T_map_camera * T_map_camera_before.inverse() * T_map_odom;
}

void Mapper::Impl::adjust_locally(const Interrupt& interrupt) {
  const Se3 before = map.find_keyframe(newest)->T_map_camera;
  const BundleSummary summary = local.adjust(newest, within(interrupt, config.bundle_budget_s));
  follow_newest(before);
  ++counters.adjustments;
  counters.adjustments_given_up += summary.outcome == BundleOutcome::Interrupted ? 1 : 0;
}

void Mapper::Impl::close_loop() {
  const Result<std::optional<LoopCorrection>> closed = loops.close(newest);
  if (!closed) {
    log_warning("a loop could not be closed: {}", closed.error().message);
    return;
  }
  if (const std::optional<LoopCorrection>& correction = *closed) {
    T_map_odom = correction->T_corrected_previous * T_map_odom;
    log_info("{} at keyframe {} with keyframe {}: corrected by {:.3f} m", correction->joined_maps ? "maps joined" : "loop closed",
             correction->keyframe, correction->matched, correction->correction_m);
    pending.adjust = config.bundle_keyframes > 0;
    pending.adjust_all = pending.adjust;
  }
}

void Mapper::Impl::adjust_all(const Interrupt& interrupt) {
  const Se3 before = map.find_keyframe(newest)->T_map_camera;
  const BundleSummary summary = local.adjuster().adjust_all(map, map.find_keyframe(newest)->map_id, kFullIterations, interrupt);
  follow_newest(before);
  pending.adjust_all = summary.outcome == BundleOutcome::Interrupted;
}

void Mapper::Impl::cull() {
  for (const KeyframeId id : local.droppable_keyframes(newest, kKeptNewest)) {
    if (local.is_redundant(*map.find_keyframe(id))) {  // judged one by one: what goes takes a witness from the others
      drop(id);
    }
  }
}

void Mapper::Impl::keep_budget() {
  while (const std::optional<KeyframeId> excess = budget.excess_keyframe(newest)) {
    drop(*excess);
  }
  budget.limit_landmarks();
}

void Mapper::Impl::drop(KeyframeId id) {
  const Keyframe& keyframe = *map.find_keyframe(id);
  const std::vector<KeyframeId> nearest = map.covisible_keyframes(id, 1, 1);
  const KeyframeId heir = !nearest.empty() ? nearest.front() : keyframe.parent != kNoKeyframe ? keyframe.parent : newest;
  dropped.remember(map, id, heir);
  places.remove(id);
  map.remove_keyframe(id);
  centre = centre == id ? heir : centre;
}

void Mapper::Impl::write_snapshot(MapSnapshot& snapshot) const {
  snapshot.version = version;
  snapshot.newest_map_id = newest_map_id;
  snapshot.newest_keyframe = newest_seen;
  snapshot.T_map_odom = T_map_odom;
  snapshot.relocalization = relocalization;
  const Keyframe* const middle = map.find_keyframe(centre);
  if (middle == nullptr) {
    snapshot.map_id = 0;
    snapshot.landmarks.clear();
    snapshot.anchors.clear();
    snapshot.keyframes.clear();
    return;
  }
  snapshot.map_id = middle->map_id;
  const LocalMap surroundings = select_local_map(map, centre, static_cast<std::size_t>(config.local_keyframes),
                                                 static_cast<std::size_t>(config.local_landmarks));
  write_local_map(map, surroundings, static_cast<std::size_t>(config.recovery_keyframes), snapshot);
}

MapHeader Mapper::Impl::header() const {
  MapHeader h;
  h.camera = estimator.camera().intrinsics();
  h.pyramid_levels = tracker_config.pyramid_levels;
  h.pyramid_scale = tracker_config.pyramid_scale;
  h.active_map = centre == kNoKeyframe ? 0 : map.find_keyframe(centre)->map_id;
  h.highest_map = newest_map_id;
  h.saved_utc_ns = SystemClock::instance().utc_ns(SystemClock::instance().now_ns());
  return h;
}

Status Mapper::Impl::load(const std::string& path) {
  Result<LoadedMap> loaded = load_map(path, header());
  if (!loaded) {
    return tl::unexpected<Error>(loaded.error());
  }
  map = std::move(loaded->map);
  newest_map_id = loaded->header.highest_map;
  for (const auto& [id, keyframe] : map.keyframes()) {
    places.add(id, keyframe.features.descriptors);
    newest_seen = id;
    newest = keyframe.map_id == loaded->header.active_map || newest == kNoKeyframe ? id : newest;
  }
  centre = newest;
  ++version;
  return {};
}

Mapper::Mapper(const TrackerConfig& tracker, const MapperConfig& config, MapMode mode, const CameraIntrinsics& camera)
    : impl_(std::make_unique<Impl>(tracker, config, mode, camera)) {}
Mapper::~Mapper() = default;

void Mapper::insert(const KeyframeRecord& record) {
  impl_->insert(record);
}
bool Mapper::improve(const Interrupt& interrupt) {
  return impl_->improve(interrupt);
}
Status Mapper::save(const std::string& path) const {
  return save_map(path, impl_->map, impl_->header());
}
Status Mapper::load(const std::string& path) {
  return impl_->load(path);
}
void Mapper::write_snapshot(MapSnapshot& snapshot) const {
  impl_->write_snapshot(snapshot);
}
std::optional<Se3> Mapper::keyframe_pose(KeyframeId id) const {
  return impl_->dropped.find_pose(impl_->map, id);
}
std::size_t Mapper::keyframe_count() const {
  return impl_->map.keyframes().size();
}
std::size_t Mapper::landmark_count() const {
  return impl_->map.landmark_count();
}

MapperCounters Mapper::counters() const {
  MapperCounters counters = impl_->counters;
  counters.loops_closed = impl_->loops.counters().closed;
  counters.loops_implausible = impl_->loops.counters().implausible;
  counters.maps_joined = impl_->loops.counters().joined;
  return counters;
}

}  // namespace posed
