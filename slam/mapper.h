#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "config/config.h"
#include "core/result.h"
#include "slam/interrupt.h"
#include "slam/keyframe_record.h"
#include "slam/map_snapshot.h"

namespace posed {

/// Counted since the start.
struct MapperCounters {
  std::uint64_t adjustments = 0;           ///< local bundle adjustments
  std::uint64_t adjustments_given_up = 0;  ///< of those, interrupted
  std::uint64_t loops_closed = 0;
  std::uint64_t loops_implausible = 0;  ///< matches in geometry that no plausible drift explains: places that look alike
  std::uint64_t maps_joined = 0;
  std::uint64_t relocalizations_asked = 0;
  std::uint64_t relocalizations_found = 0;
};

/// Owns all maps: takes keyframes in, improves the map while there is time, finds a lost camera, and writes snapshots for the
/// tracker. What it does depends on the calls alone, and, in real time, on when it is interrupted. Thread-bound: everything is
/// called by one thread, the mapping thread (in lockstep, the only one).
class Mapper {
 public:
  Mapper(const TrackerConfig& tracker, const MapperConfig& config, MapMode mode, const CameraIntrinsics& camera);
  ~Mapper();

  /// Takes a keyframe in, or looks for the place that a relocalisation's frame shows. Short: the tracker waits for the snapshot
  /// that follows. `record` is the caller's again on return.
  void insert(const KeyframeRecord& record);

  /// Does the next piece of what is worth doing to the map after the last keyframe (new landmarks from neighbours, local bundle
  /// adjustment, culling, loop closing, adjustment of the whole map); false where nothing is left. An interrupted piece keeps what
  /// it has reached; the adjustment of the whole map is then taken up again. Where `interrupt` is not empty, pieces also keep to
  /// their configured time.
  bool improve(const Interrupt& interrupt);

  /// Writes all maps to a file, which is replaced as a whole. Errors: as save_map; the old file is kept.
  Status save(const std::string& path) const;

  /// Before the first keyframe: takes the maps of a file. Errors: as load_map; nothing is taken then.
  Status load(const std::string& path);

  /// Overwrites `snapshot` with the present local map; its vectors keep their capacity.
  void write_snapshot(MapSnapshot& snapshot) const;

  /// Present pose of a keyframe, for the final trajectory; kept also for keyframes that the map has dropped (then relative to one
  /// that it kept). Nothing for an unknown id.
  std::optional<Se3> keyframe_pose(KeyframeId id) const;

  std::size_t keyframe_count() const;
  std::size_t landmark_count() const;
  MapperCounters counters() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace posed
