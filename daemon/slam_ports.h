#pragma once

#include <memory>
#include <optional>
#include <string>

#include "config/config.h"
#include "core/detections.h"
#include "core/estimates.h"
#include "core/result.h"
#include "core/rgbd_frame.h"
#include "slam/dynamic_mask.h"
#include "slam/features.h"
#include "slam/keyframe_record.h"
#include "slam/map_snapshot.h"
#include "slam/mapper.h"

namespace posed {

/// The tracker as the pipeline sees it (slam/tracker.h says what is asked of it), so that the pipeline can be tested without
/// vision. Thread-bound.
class FrameTracker {
 public:
  virtual ~FrameTracker() = default;
  virtual PoseEstimate track(const RgbdFrame& frame, const MapSnapshot& map, const Detections* newest,
                             KeyframeRecord* candidate) = 0;

  /// What was masked in the last frame; null where nothing ever is.
  virtual const DynamicMask* last_mask() const { return nullptr; }
  /// The features of the last frame that were kept; null where there is nothing to tell.
  virtual const Features* last_features() const { return nullptr; }
};

/// The mapper as the pipeline sees it (slam/mapper.h). Thread-bound.
class KeyframeMapper {
 public:
  virtual ~KeyframeMapper() = default;
  virtual void insert(const KeyframeRecord& record) = 0;
  virtual bool improve(const Interrupt& interrupt) = 0;
  virtual void write_snapshot(MapSnapshot& snapshot) const = 0;
  virtual std::optional<Se3> keyframe_pose(KeyframeId id) const = 0;
  virtual std::size_t keyframe_count() const = 0;
  virtual std::size_t landmark_count() const = 0;
  virtual MapperCounters counters() const = 0;

  /// Replaces the file `path` by the present map (slam/map_io.h, also for the errors).
  virtual Status save(const std::string& path) = 0;

  /// Begins with the map of the file `path`; before any keyframe.
  virtual Status load(const std::string& path) = 0;
};

/// The real ones. Reentrant.
std::unique_ptr<FrameTracker> make_frame_tracker(const Config& config);
std::unique_ptr<KeyframeMapper> make_keyframe_mapper(const Config& config);

}  // namespace posed
