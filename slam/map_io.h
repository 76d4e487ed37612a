#pragma once

#include <cstdint>
#include <string>

#include "core/pinhole_camera.h"
#include "core/result.h"
#include "slam/map.h"

/// Saved maps: the container of slam/map_file.h with the messages map_*_t, landmarks and keyframes each by ascending identifier.
/// What follows from the rest is not saved: the covisibility graph, the landmarks' observations (from the keyframes' links; their
/// order becomes that of the keyframes) and undistorted pixels (from the camera).
namespace posed {

/// What a map was made with, and what numbers go on from.
struct MapHeader {
  CameraIntrinsics camera;
  int pyramid_levels = 0;
  double pyramid_scale = 0;

  std::uint32_t active_map = 0;   ///< the one being extended
  std::uint32_t highest_map = 0;  ///< no map has had a higher identifier
  std::int64_t saved_utc_ns = 0;  ///< saved to the microsecond
};

struct LoadedMap {
  MapHeader header;
  Map map;
};

/// Replaces the file `path` (core/atomic_file.h). Its bytes are a function of the arguments alone. Landmarks that no keyframe
/// observes are left out. Needs little memory besides the map; blocks for as long as the disk does. Reentrant. Errors: those of
/// AtomicFile; InvalidArgument where the map breaks a rule of its own, so that it could not be loaded again. The old file is kept
/// with every error.
Status save_map(const std::string& path, const Map& map, const MapHeader& header);

/// Reads and checks all of `path`, which it never changes. `expected` says which camera and pyramid the map must have been made
/// with. Reentrant. Errors: NotFound; Io; BadData (foreign or damaged); Unsupported (newer); InvalidConfig (another camera or
/// pyramid).
Result<LoadedMap> load_map(const std::string& path, const MapHeader& expected);

}  // namespace posed
