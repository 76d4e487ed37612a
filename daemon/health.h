#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "core/estimates.h"
#include "core/metrics.h"
#include "drivers/gpio_lines.h"
#include "drivers/rgbd_source.h"

namespace posed {

/// State, counters and latencies of a running pipeline at one instant. Counters only grow. Plain data.
struct HealthReport {
  TrackingState state = TrackingState::Initializing;
  bool source_failed = false;
  bool source_ended = false;
  SourceHealth source;
  bool paused = false;  ///< frames are taken and let go, and no poses are made
  GpioHealth gpio;

  std::uint64_t frames_captured = 0;  ///< frames that reached the pool
  std::uint64_t frames_skipped = 0;   ///< bad frames of the source, left out
  std::uint64_t frames_missed = 0;    ///< gaps in the source's count that nothing else explains: lost before it, or it was too slow
  std::uint64_t frames_no_slot = 0;   ///< lost because the frame pool was exhausted
  std::uint64_t frames_paused = 0;    ///< of those captured: let go because the daemon was paused
  std::uint64_t frames_dropped = 0;   ///< handed back by the full queue before the tracker
  std::uint64_t frames_tracked = 0;   ///< with a pose
  std::uint64_t frames_lost = 0;      ///< processed, without a pose
  std::uint64_t keyframes = 0;        ///< handed to the mapper
  std::uint64_t keyframes_delayed = 0;  ///< frames on which the mapper's queue was full
  std::uint64_t poses_published = 0;
  std::uint64_t poses_dropped = 0;  ///< handed back by the full queue before the publisher
  std::uint64_t publish_errors = 0;
  bool transport_up = false;  ///< LCM runs

  std::size_t map_keyframes = 0;
  std::size_t map_landmarks = 0;
  std::uint64_t loops_closed = 0;
  std::uint64_t maps_joined = 0;
  std::uint64_t relocalizations = 0;  ///< times that the place of a lost camera was found
  std::uint64_t map_saves = 0;
  std::uint64_t map_save_errors = 0;

  std::string detector_model;              ///< file name of the model used last; empty: nobody is looked for
  std::uint64_t detected = 0;              ///< frames the detector has looked at
  std::uint64_t detections_abandoned = 0;  ///< frames given up because the budget was spent
  std::uint64_t detections_dropped = 0;    ///< handed back by the full queue before the publisher
  std::uint64_t detector_errors = 0;       ///< frames on which its library failed

  float masked_share = 0;         ///< of the newest frame's image that shows movers, 0 to 1
  std::int32_t people = 0;        ///< movers in it that a detection explains
  std::int32_t other_movers = 0;  ///< movers in it that only their motion gives away
  TimeNs detection_age_ns = -1;   ///< of the person detections it used; -1: none were

  LatencySummary track;           ///< time in the tracker a frame
  LatencySummary latency;         ///< capture to publish
  LatencySummary map;             ///< time in the mapper a keyframe
  LatencySummary detect;          ///< time in the detector a frame, those given up included
  LatencySummary detect_overrun;  ///< past the budget, of the frames that took longer
  std::uint64_t peak_rss_bytes = 0;
};

}  // namespace posed
