#include "daemon/publisher.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "core/logging.h"
#include "daemon/message_conversion.h"
#include "daemon/version.h"

namespace posed {

Publisher::Publisher(const PublisherConfig& config, const Se3& T_base_camera, std::unique_ptr<MessageTransport> transport,
                     const Clock& clock, std::function<HealthReport()> health, std::unique_ptr<MapRequests> requests)
    : config_(config),
      channels_{config.channel_prefix + "POSE",        config.channel_prefix + "STATUS",    config.channel_prefix + "BOT_POSE",
                config.channel_prefix + "MAP_REQUEST", config.channel_prefix + "MAP_REPLY", config.channel_prefix + "DETECTIONS"},
      T_base_camera_(T_base_camera),
      transport_(std::move(transport)),
      clock_(clock),
      health_(std::move(health)),
      requests_(std::move(requests)),
      times_{0, std::numeric_limits<TimeNs>::min(), std::numeric_limits<TimeNs>::min()},
      status_period_ns_(from_seconds(config.status_period_s)) {
  if (requests_) {
    transport_->subscribe(channels_.map_request, [this](std::span<const std::uint8_t> message) { requests_->receive(message); });
  }
}

void Publisher::publish(const PoseEstimate& estimate, TimeNs publish_ns) {
  if (send(channels_.pose, to_pose_message(estimate, T_base_camera_, publish_ns))) {
    poses_published_.add();
  }
  if (config_.bot_core_pose) {
    if (const std::optional<bot_core::pose_t> pose = to_bot_core_pose(estimate, T_base_camera_)) {
      send(channels_.bot_pose, *pose);
    }
  }
}

void Publisher::publish(const Detections& detections, TimeNs publish_ns) {
  send(channels_.detections, to_detections_message(detections, publish_ns));
}

TimeNs Publisher::do_due_work() {
  const TimeNs now_ns = clock_.now_ns();
  if (!open_ && now_ns >= times_.next_open_ns) {
    open_transport(now_ns);
  }
  if (now_ns >= times_.next_status_ns) {
    publish_status();
    times_.next_status_ns = now_ns + status_period_ns_.load(std::memory_order_relaxed);
  }
  if (open_ && requests_) {
    answer_requests();
  }
  return open_ ? times_.next_status_ns : std::min(times_.next_status_ns, times_.next_open_ns);
}

void Publisher::answer_requests() {
  transport_->receive();
  for (const map_reply_t& reply : requests_->take_replies()) {
    send(channels_.map_reply, reply);
  }
}

void Publisher::publish_status() {
  StatusOrigin origin;
  origin.mono_ns = clock_.now_ns();
  origin.utc_ns = clock_.utc_ns(origin.mono_ns);
  origin.version = version();
  origin.transport = transport_->description();
  send(channels_.status, to_status_message(health_(), origin));
}

void Publisher::report(HealthReport& health) const {
  health.poses_published = poses_published_.value();
  health.publish_errors = errors_.value();
  health.transport_up = up_.load(std::memory_order_relaxed);
}

void Publisher::open_transport(TimeNs now_ns) {
  const Status opened = transport_->open();
  open_ = opened.has_value();
  times_.next_open_ns = now_ns + from_seconds(config_.retry_period_s);
  note(opened);
}

template <typename Message>
bool Publisher::send(const std::string& channel, const Message& message) {
  if (!open_) {
    errors_.add();
    return false;
  }
  buffer_.resize(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(buffer_.data(), 0, static_cast<int>(buffer_.size()));
  const Status sent = transport_->send(channel, buffer_);
  if (!sent) {
    errors_.add();
  }
  note(sent);
  return sent.has_value();
}

void Publisher::note(const Status& outcome) {
  up_.store(outcome.has_value(), std::memory_order_relaxed);
  if (!outcome) {
    times_.last_failure_ns = clock_.now_ns();
    if (!complained_) {
      complained_ = true;
      log_warning("{}. Tracking goes on; this is said once until publishing works again", outcome.error().message);
    }
  } else if (complained_ && clock_.now_ns() - times_.last_failure_ns >= from_seconds(config_.retry_period_s)) {
    complained_ = false;  // after a quiet period only: an error that comes and goes must not fill the log
    log_info("publishing on '{}' works again", transport_->description());
  }
}

}  // namespace posed
