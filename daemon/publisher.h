#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "config/config.h"
#include "core/clock.h"
#include "core/detections.h"
#include "core/estimates.h"
#include "core/metrics.h"
#include "core/se3.h"
#include "daemon/health.h"
#include "daemon/map_requests.h"
#include "daemon/message_transport.h"

namespace posed {

/// Turns estimates and health into messages and sends them; keeps trying where the transport cannot start; answers requests.
/// Thread-bound to the publisher thread, but for `report`, which is thread-safe. Its clock decides when status and retries are due,
/// so tests need not wait.
class Publisher {
 public:
  /// `clock` must outlive it. `health` is asked whenever a status is due. `requests` may be null.
  Publisher(const PublisherConfig& config, const Se3& T_base_camera, std::unique_ptr<MessageTransport> transport,
            const Clock& clock, std::function<HealthReport()> health, std::unique_ptr<MapRequests> requests = nullptr);

  /// Sends the pose (and the bot_core pose where it is configured), stamped with `publish_ns`.
  void publish(const PoseEstimate& estimate, TimeNs publish_ns);

  /// Sends the people seen in a frame, stamped with `publish_ns`.
  void publish(const Detections& detections, TimeNs publish_ns);

  /// Does what is due by now: opens the transport, sends a status, takes requests and sends replies. Returns when it wants to be
  /// called next [ns, monotonic].
  TimeNs do_due_work();

  /// Of the status messages. Thread-safe; holds from the next one on.
  void set_status_period(TimeNs period_ns) noexcept { status_period_ns_.store(period_ns, std::memory_order_relaxed); }

  /// Sends a status now: at the end of the source and before a stop.
  void publish_status();

  void report(HealthReport& health) const;

 private:
  void open_transport(TimeNs now_ns);
  void answer_requests();

  /// Encodes and sends; true where the transport took it.
  template <typename Message>
  bool send(const std::string& channel, const Message& message);

  /// Keeps `transport_up` and the log.
  void note(const Status& outcome);

  PublisherConfig config_;
  struct Channels {
    std::string pose;
    std::string status;
    std::string bot_pose;
    std::string map_request;
    std::string map_reply;
    std::string detections;
  } channels_;
  Se3 T_base_camera_;
  std::unique_ptr<MessageTransport> transport_;
  const Clock& clock_;
  std::function<HealthReport()> health_;
  std::unique_ptr<MapRequests> requests_;

  bool open_ = false;
  bool complained_ = false;  // of the present trouble
  struct Times {
    TimeNs last_failure_ns = 0;
    TimeNs next_open_ns = 0;
    TimeNs next_status_ns = 0;
  } times_;
  std::vector<std::uint8_t> buffer_;

  std::atomic<TimeNs> status_period_ns_;
  Counter poses_published_;
  Counter errors_;
  std::atomic<bool> up_{false};
};

}  // namespace posed
