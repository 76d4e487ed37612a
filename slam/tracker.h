#pragma once

#include <memory>

#include "config/config.h"
#include "core/detections.h"
#include "core/estimates.h"
#include "core/rgbd_frame.h"
#include "slam/dynamic_mask.h"
#include "slam/feature_frame.h"
#include "slam/keyframe_record.h"
#include "slam/map_snapshot.h"

namespace posed {

/// Tracks the camera, frame by frame, against a snapshot of the map. Never waits, takes no lock and, after the first frames, does
/// not allocate; it is bounded in time by the number of features and landmarks. A function of its inputs alone: the same frames
/// with the same snapshots and detections give the same bits. What moves is left out of the pose and of keyframes. Thread-bound:
/// one thread calls `track`.
class Tracker {
 public:
  /// `T_map_camera_start`: the camera's pose in the map frame when the first map begins. In `MapMode::Localization` none is begun.
  Tracker(const TrackerConfig& config, const MapperConfig& mapper, const DynamicConfig& dynamic, MapMode mode,
          const CameraIntrinsics& camera, const Se3& T_map_camera_start);
  ~Tracker();

  /// The pose of `frame`. Where the frame should become a keyframe or, the camera being lost, the mapper should say where it is,
  /// and `candidate` is not null, fills `*candidate` and says so in `PoseEstimate::keyframe` or `asks_where`; the caller then hands
  /// it to the mapper. `newest`: the people found last, in this frame or an earlier one; null: nobody looks. A null `candidate`
  /// (the mapper is behind) only delays it.
  PoseEstimate track(const RgbdFrame& frame, const MapSnapshot& map, const Detections* newest, KeyframeRecord* candidate);

  /// Time spent in the parts of the last `track` [ns].
  struct Timing {
    TimeNs mask_ns = 0;
    TimeNs extract_ns = 0;
    TimeNs match_ns = 0;
    TimeNs solve_ns = 0;
  };
  const Timing& last_timing() const;

  /// What was masked in the last frame; null where nothing ever is.
  const DynamicMask* last_mask() const;
  /// The features that were kept.
  const FeatureFrame& last_features() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace posed
