#pragma once

#include <memory>
#include <optional>

#include "config/config.h"
#include "slam/keyframe_record.h"
#include "slam/map_snapshot.h"

namespace posed {

/// Owns the map: takes keyframes in, makes and maintains landmarks, and writes snapshots for the tracker. Thread-bound: everything
/// is called by one thread, the mapper's (in lockstep, the only one).
class LocalMapper {
 public:
  LocalMapper(const TrackerConfig& tracker, const MapperConfig& config, const CameraIntrinsics& camera);
  ~LocalMapper();

  /// Takes a keyframe in. `record` is the caller's again on return.
  void insert(const KeyframeRecord& record);

  /// Overwrites `snapshot` with the present local map; its vectors keep their capacity.
  void write_snapshot(MapSnapshot& snapshot) const;

  /// Present pose of a keyframe, for the final trajectory; kept also for keyframes that the map has dropped (then relative to a
  /// keyframe that it kept). Nothing for an unknown id.
  std::optional<Se3> keyframe_pose(KeyframeId id) const;

  std::size_t keyframe_count() const;
  std::size_t landmark_count() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace posed
