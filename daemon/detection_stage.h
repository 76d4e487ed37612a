#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <stop_token>
#include <vector>

#include "core/detections.h"
#include "core/heartbeat.h"
#include "core/latest_value.h"
#include "core/metrics.h"
#include "core/rgbd_frame.h"
#include "daemon/detector_port.h"
#include "daemon/health.h"
#include "daemon/stage_link.h"

namespace posed {

/// Looks for people in the newest frame, as often as the detector can: frames that come meanwhile are passed over, so that what it
/// finds is never older than it must be. Thread-bound to the detector thread (in lockstep, the tracking thread), but for `report`,
/// which is thread-safe.
class DetectionStage {
 public:
  struct Links {
    NewestFrameLink& frames;
    DetectionsLink& publisher;
    LatestValue<Detections>& tracker;
  };

  /// `detector` may be null: then nobody is looked for. Everything passed in must outlive the stage. `wake_publisher` is called
  /// after something was put into the publisher's link, or it was closed. `lockstep_lag`: frames by which the tracker gets
  /// detections late in lockstep.
  DetectionStage(FrameDetector* detector, Links links, std::function<void()> wake_publisher, int lockstep_lag, const Clock& clock);

  bool is_enabled() const { return detector_ != nullptr; }

  /// The thread's body in real time. Closes the publisher's link when the frames have ended.
  void run(const std::stop_token& stop);

  /// In lockstep: every frame, as long as it takes; waits where the publisher is behind. Then the tracker learns what was found
  /// `lockstep_lag` frames ago.
  void detect_unhurried(const RgbdFrame& frame, const std::stop_token& stop);

  /// Tells the publisher that nothing follows.
  void close_output();

  void report(HealthReport& health) const;
  const Heartbeat& heartbeat() const { return heartbeat_; }

 private:
  void note(const Result<DetectionOutcome>& outcome);
  void hand_on(const Detections& found);

  FrameDetector* detector_;
  Links links_;
  std::function<void()> wake_publisher_;
  const Clock& clock_;
  bool complained_ = false;          // of the engine
  std::vector<Detections> delayed_;  // in lockstep, a ring: those that the tracker does not know yet
  std::size_t next_delayed_ = 0;

  Counter detected_;
  Counter abandoned_;
  Counter errors_;
  Counter dropped_;
  std::atomic<std::size_t> model_{0};
  LatencyHistogram detect_time_;
  Heartbeat heartbeat_;
  LatencyHistogram overrun_;
};

}  // namespace posed
