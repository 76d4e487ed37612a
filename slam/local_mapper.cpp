#include "slam/local_mapper.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <unordered_set>
#include <vector>

#include <Eigen/LU>

#include "core/pinhole_camera.h"
#include "slam/descriptor.h"
#include "slam/map.h"
#include "slam/measurement_noise.h"

namespace posed {

namespace {

constexpr double kMinDepth = 0.05;                 // [m]
constexpr double kChi2ThreeDof = 11.345;           // 99 %: an observation beyond does not move the landmark
constexpr std::uint32_t kPredictedBeforeCull = 4;  // keyframes that should have seen a landmark before it is judged
constexpr double kMinFoundShare = 0.3;
constexpr std::size_t kDescriptorCandidates = 8;  // newest observations among which the descriptor is chosen
constexpr std::size_t kForwardedPoses = 100'000;  // poses remembered of keyframes that the map has dropped

/// Measurement of a landmark by a keyframe, linearised at the landmark's present position.
struct LinearMeasurement {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  // of the landmark in the map frame
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();     // J^T W e
  double chi2 = std::numeric_limits<double>::infinity();
};

}  // namespace

struct LocalMapper::Impl {
  Impl(const TrackerConfig& tracker, const MapperConfig& mapper, const CameraIntrinsics& intrinsics)
      : tracker_config(tracker), config(mapper), camera(intrinsics), noise(tracker, intrinsics) {}

  void insert(const KeyframeRecord& record);
  void extend_observed(const KeyframeRecord& record);
  void judge_predicted(const KeyframeRecord& record);
  void create_landmarks(const KeyframeRecord& record);
  void limit_keyframes(KeyframeId newest);

  LinearMeasurement linearise(const Landmark& landmark, const Keyframe& keyframe, std::uint16_t keypoint) const;
  void refresh_appearance(Landmark& landmark) const;
  bool predicted_in_view(const Landmark& landmark, const Keyframe& keyframe) const;
  void select_local_keyframes();
  void write_snapshot(MapSnapshot& snapshot) const;
  std::vector<LandmarkId> local_landmarks() const;
  struct Forwarded;
  void forward(KeyframeId keyframe, const Forwarded& where);

  TrackerConfig tracker_config;
  MapperConfig config;
  PinholeCamera camera;
  MeasurementNoise noise;
  Map map;
  std::uint32_t map_id = 0;
  std::uint64_t version = 0;
  std::vector<KeyframeId> local_keyframes;  // best first

  /// Where a keyframe that the map has dropped is: relative to a newer one, or (anchor kNoKeyframe) in the map frame.
  struct Forwarded {
    KeyframeId anchor;
    Se3 T_anchor_keyframe;
  };
  std::map<KeyframeId, Forwarded> forwarded;
};

LinearMeasurement LocalMapper::Impl::linearise(const Landmark& landmark, const Keyframe& keyframe, std::uint16_t keypoint) const {
  LinearMeasurement m;
  const Eigen::Matrix3d R_camera_map = keyframe.T_map_camera.rotation_matrix().transpose();
  const Eigen::Vector3d p = R_camera_map * (landmark.p_map - keyframe.T_map_camera.translation());
  if (p.z() < kMinDepth) {
    return m;
  }
  const CameraIntrinsics& k = camera.intrinsics();
  const double inverse_z = 1.0 / p.z();
  const double z = keyframe.depth_m[keypoint];
  const int level = keyframe.features.keypoints[keypoint].level;
  Eigen::Matrix3d projection;
  projection << k.fx * inverse_z, 0, -k.fx * p.x() * inverse_z * inverse_z,  //
      0, k.fy * inverse_z, -k.fy * p.y() * inverse_z * inverse_z,            //
      0, 0, -k.baseline_fx * inverse_z * inverse_z;
  const Eigen::Matrix3d jacobian = projection * R_camera_map;
  const Eigen::Vector2d predicted = camera.project(p);
  const Eigen::Vector2d pixel = keyframe.ideal_pixels[keypoint].cast<double>();
  const Eigen::Vector3d error(pixel.x() - predicted.x(), pixel.y() - predicted.y(),
                              z > 0 ? k.baseline_fx / z - k.baseline_fx * inverse_z : 0.0);
  const double w = noise.pixel_weight(level);
  const Eigen::Vector3d weight(w, w, z > 0 ? noise.disparity_weight(level, z) : 0.0);
  m.information = jacobian.transpose() * weight.asDiagonal() * jacobian;
  m.gradient = jacobian.transpose() * weight.cwiseProduct(error);
  m.chi2 = weight.dot(error.cwiseAbs2());
  return m;
}

void LocalMapper::Impl::refresh_appearance(Landmark& landmark) const {
  const auto& observations = landmark.observations;
  Eigen::Vector3d view = Eigen::Vector3d::Zero();
  for (const Observation& o : observations) {
    view += (landmark.p_map - map.find_keyframe(o.keyframe)->T_map_camera.translation()).normalized();
  }
  landmark.mean_view_map = view.normalized();

  const Observation& newest = observations.back();
  const Keyframe& keyframe = *map.find_keyframe(newest.keyframe);
  const auto distance = static_cast<float>((landmark.p_map - keyframe.T_map_camera.translation()).norm());
  const auto step = static_cast<float>(tracker_config.pyramid_scale);
  landmark.max_distance_m = distance * std::pow(step, static_cast<float>(keyframe.features.keypoints[newest.keypoint].level));
  landmark.min_distance_m = landmark.max_distance_m / std::pow(step, static_cast<float>(tracker_config.pyramid_levels - 1));

  // The descriptor with the least median distance to the others stands for them all.
  const std::size_t count = std::min(observations.size(), kDescriptorCandidates);
  const Descriptor* candidates[kDescriptorCandidates];
  for (std::size_t i = 0; i < count; ++i) {
    const Observation& o = observations[observations.size() - count + i];
    candidates[i] = &map.find_keyframe(o.keyframe)->features.descriptors[o.keypoint];
  }
  int least_median = std::numeric_limits<int>::max();
  for (std::size_t i = 0; i < count; ++i) {
    int distances[kDescriptorCandidates];
    for (std::size_t j = 0; j < count; ++j) {
      distances[j] = hamming_distance(*candidates[i], *candidates[j]);
    }
    std::nth_element(distances, distances + count / 2, distances + count);
    if (distances[count / 2] < least_median) {
      least_median = distances[count / 2];
      landmark.descriptor = *candidates[i];
    }
  }
}

/// Links the record's matches and lets each measurement move its landmark, weighted by the information of both.
void LocalMapper::Impl::extend_observed(const KeyframeRecord& record) {
  const Keyframe& keyframe = *map.find_keyframe(record.id);
  for (std::size_t i = 0; i < record.landmarks.size(); ++i) {
    Landmark* landmark = record.landmarks[i] == kNoLandmark ? nullptr : map.find_landmark(record.landmarks[i]);
    if (landmark == nullptr) {
      continue;  // culled since the tracker's snapshot
    }
    const auto keypoint = static_cast<std::uint16_t>(i);
    const LinearMeasurement m = linearise(*landmark, keyframe, keypoint);
    if (m.chi2 > kChi2ThreeDof) {
      continue;
    }
    map.observe(record.landmarks[i], record.id, keypoint);
    landmark->information += m.information;
    landmark->p_map += landmark->information.inverse() * m.gradient;
    refresh_appearance(*landmark);
  }
}

bool LocalMapper::Impl::predicted_in_view(const Landmark& landmark, const Keyframe& keyframe) const {
  const Eigen::Vector3d p = keyframe.T_map_camera.inverse() * landmark.p_map;
  if (p.z() < kMinDepth) {
    return false;
  }
  const Eigen::Vector2d pixel = camera.project(p);
  const double distance = p.norm();
  const double view_cosine = (keyframe.T_map_camera.rotation() * p).dot(landmark.mean_view_map) / distance;
  return pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < camera.intrinsics().width && pixel.y() < camera.intrinsics().height &&
         distance < landmark.max_distance_m && distance > landmark.min_distance_m && view_cosine > 0.5;
}

/// A landmark that keyframes keep missing where they should see it (noise, a mover, a wrong match) is removed.
void LocalMapper::Impl::judge_predicted(const KeyframeRecord& record) {
  const Keyframe& keyframe = *map.find_keyframe(record.id);
  for (const LandmarkId id : local_landmarks()) {
    Landmark& landmark = *map.find_landmark(id);
    const bool found = landmark.observations.back().keyframe == record.id;
    if (!found && !predicted_in_view(landmark, keyframe)) {
      continue;
    }
    ++landmark.predicted;
    landmark.found += found ? 1 : 0;
    if (landmark.predicted >= kPredictedBeforeCull && landmark.found < kMinFoundShare * landmark.predicted) {
      map.remove_landmark(id);
    }
  }
}

void LocalMapper::Impl::create_landmarks(const KeyframeRecord& record) {
  const Keyframe& keyframe = *map.find_keyframe(record.id);
  for (std::size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    const double z = keyframe.depth_m[i];
    if (keyframe.landmarks[i] != kNoLandmark || z < kMinDepth || z > tracker_config.close_depth_m) {
      continue;
    }
    const auto keypoint = static_cast<std::uint16_t>(i);
    Landmark landmark;
    landmark.p_map = keyframe.T_map_camera * camera.unproject(keyframe.ideal_pixels[i].cast<double>(), z);
    landmark.information = linearise(landmark, keyframe, keypoint).information;
    landmark.predicted = 1;
    landmark.found = 1;
    const LandmarkId id = map.add_landmark(std::move(landmark));
    map.observe(id, record.id, keypoint);
    refresh_appearance(*map.find_landmark(id));
  }
}

/// The newest keyframe, then those that share most landmarks with it, then the nearest in place and direction.
void LocalMapper::Impl::select_local_keyframes() {
  const auto& keyframes = map.keyframes();
  const auto& [newest_id, newest] = *keyframes.rbegin();
  struct Ranked {
    KeyframeId id;
    int shared;
    double distance;
  };
  std::vector<Ranked> ranked;
  std::map<KeyframeId, int> shared;
  for (const LandmarkId id : newest.landmarks) {
    if (const Landmark* landmark = map.find_landmark(id)) {
      for (const Observation& o : landmark->observations) {
        ++shared[o.keyframe];
      }
    }
  }
  for (const auto& [id, keyframe] : keyframes) {
    const Vector6d offset = (newest.T_map_camera.inverse() * keyframe.T_map_camera).log();
    ranked.push_back({id, id == newest_id ? std::numeric_limits<int>::max() : shared[id], offset.norm()});
  }
  const auto count = std::min<std::size_t>(ranked.size(), static_cast<std::size_t>(config.local_keyframes));
  std::partial_sort(
      ranked.begin(), ranked.begin() + static_cast<std::ptrdiff_t>(count), ranked.end(), [](const Ranked& a, const Ranked& b) {
        return a.shared != b.shared ? a.shared > b.shared : a.distance != b.distance ? a.distance < b.distance : a.id > b.id;
      });
  local_keyframes.clear();
  for (std::size_t i = 0; i < count; ++i) {
    local_keyframes.push_back(ranked[i].id);
  }
}

std::vector<LandmarkId> LocalMapper::Impl::local_landmarks() const {
  std::vector<LandmarkId> ids;
  for (const KeyframeId keyframe : local_keyframes) {
    const Keyframe* k = map.find_keyframe(keyframe);
    if (k != nullptr) {
      std::copy_if(k->landmarks.begin(), k->landmarks.end(), std::back_inserter(ids),
                   [](LandmarkId id) { return id != kNoLandmark; });
    }
  }
  // Landmarks of the better keyframes come first, so that the limit takes away the least related.
  std::vector<LandmarkId> kept;
  std::unordered_set<LandmarkId> seen;
  for (const LandmarkId id : ids) {
    if (kept.size() < static_cast<std::size_t>(config.local_landmarks) && seen.insert(id).second) {
      kept.push_back(id);
    }
  }
  std::sort(kept.begin(), kept.end());
  return kept;
}

/// Drops the oldest keyframes that are not local; their poses live on relative to the oldest that is kept.
void LocalMapper::Impl::limit_keyframes(KeyframeId newest) {
  while (map.keyframes().size() > static_cast<std::size_t>(config.max_keyframes)) {
    const auto oldest = std::find_if(map.keyframes().begin(), map.keyframes().end(), [&](const auto& entry) {
      return entry.first != newest &&
             std::find(local_keyframes.begin(), local_keyframes.end(), entry.first) == local_keyframes.end();
    });
    const auto dropped = oldest == map.keyframes().end() ? map.keyframes().begin() : oldest;
    const auto anchor = std::next(dropped);
    forward(dropped->first, {anchor->first, anchor->second.T_map_camera.inverse() * dropped->second.T_map_camera});
    map.remove_keyframe(dropped->first);
  }
}

void LocalMapper::Impl::forward(KeyframeId keyframe, const Forwarded& where) {
  forwarded[keyframe] = where;
  if (forwarded.size() > kForwardedPoses) {
    forwarded.erase(forwarded.begin());
  }
}

void LocalMapper::Impl::insert(const KeyframeRecord& record) {
  if (record.starts_map) {
    for (const auto& [id, keyframe] : map.keyframes()) {
      forward(id, {kNoKeyframe, keyframe.T_map_camera});
    }
    map.clear();
    local_keyframes.clear();
    map_id = record.map_id;
  }
  map.add_keyframe(record);
  extend_observed(record);
  judge_predicted(record);
  create_landmarks(record);
  select_local_keyframes();
  limit_keyframes(record.id);
  ++version;
}

void LocalMapper::Impl::write_snapshot(MapSnapshot& snapshot) const {
  snapshot.version = version;
  snapshot.map_id = map_id;
  snapshot.T_map_odom = Se3();
  snapshot.newest_keyframe = map.keyframes().empty() ? kNoKeyframe : map.keyframes().rbegin()->first;
  const std::vector<LandmarkId> ids = local_landmarks();
  snapshot.landmarks.clear();
  for (const LandmarkId id : ids) {
    const Landmark& l = *map.find_landmark(id);
    snapshot.landmarks.push_back(
        {id, l.p_map.cast<float>(), l.mean_view_map.cast<float>(), l.max_distance_m, l.min_distance_m, l.descriptor});
  }
  const std::size_t count = std::min(map.keyframes().size(), static_cast<std::size_t>(config.recovery_keyframes));
  snapshot.keyframes.resize(count);
  auto keyframe = map.keyframes().rbegin();
  for (std::size_t i = 0; i < count; ++i, ++keyframe) {
    SnapshotKeyframe& s = snapshot.keyframes[i];
    s.id = keyframe->first;
    s.T_map_camera = keyframe->second.T_map_camera;
    s.landmarks.clear();
    for (const LandmarkId id : keyframe->second.landmarks) {
      const auto it = std::lower_bound(ids.begin(), ids.end(), id);
      if (id != kNoLandmark && it != ids.end() && *it == id) {
        s.landmarks.push_back(static_cast<std::uint32_t>(it - ids.begin()));
      }
    }
  }
}

LocalMapper::LocalMapper(const TrackerConfig& tracker, const MapperConfig& config, const CameraIntrinsics& camera)
    : impl_(std::make_unique<Impl>(tracker, config, camera)) {}
LocalMapper::~LocalMapper() = default;

void LocalMapper::insert(const KeyframeRecord& record) {
  impl_->insert(record);
}
void LocalMapper::write_snapshot(MapSnapshot& snapshot) const {
  impl_->write_snapshot(snapshot);
}
std::size_t LocalMapper::keyframe_count() const {
  return impl_->map.keyframes().size();
}
std::size_t LocalMapper::landmark_count() const {
  return impl_->map.landmark_count();
}

std::optional<Se3> LocalMapper::keyframe_pose(KeyframeId id) const {
  // An anchor may itself have been dropped later; anchors are newer than what hangs on them, so this ends.
  Se3 T_found_wanted;
  while (true) {
    if (const Keyframe* keyframe = impl_->map.find_keyframe(id)) {
      return keyframe->T_map_camera * T_found_wanted;
    }
    const auto it = impl_->forwarded.find(id);
    if (it == impl_->forwarded.end()) {
      return std::nullopt;
    }
    T_found_wanted = it->second.T_anchor_keyframe * T_found_wanted;
    id = it->second.anchor;
    if (id == kNoKeyframe) {
      return T_found_wanted;
    }
  }
}

}  // namespace posed
