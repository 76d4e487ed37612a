#pragma once

#include <memory>

#include "config/config.h"
#include "core/estimates.h"
#include "core/rgbd_frame.h"
#include "slam/keyframe_record.h"
#include "slam/map_snapshot.h"

namespace posed {

/// Tracks the camera, frame by frame, against a snapshot of the map. Never waits, takes no lock and, after the first frames, does
/// not allocate; it is bounded in time by the number of features and landmarks. A function of its inputs alone: the same frames
/// with the same snapshots give the same bits. Thread-bound: one thread calls `track`.
class Tracker {
 public:
  /// `T_map_camera_start`: the camera's pose in the map frame when the first map begins. In `MapMode::Localization` none is begun.
  Tracker(const TrackerConfig& config, const MapperConfig& mapper, MapMode mode, const CameraIntrinsics& camera,
          const Se3& T_map_camera_start);
  ~Tracker();

  /// The pose of `frame`. Where the frame should become a keyframe or, the camera being lost, the mapper should say where it is,
  /// and `candidate` is not null, fills `*candidate` and says so in `PoseEstimate::keyframe` or `asks_where`; the caller then hands
  /// it to the mapper. A null `candidate` (the mapper is behind) only delays it.
  PoseEstimate track(const RgbdFrame& frame, const MapSnapshot& map, KeyframeRecord* candidate);

  /// Time spent in the parts of the last `track` [ns].
  struct Timing {
    TimeNs extract_ns = 0;
    TimeNs match_ns = 0;
    TimeNs solve_ns = 0;
  };
  const Timing& last_timing() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace posed
