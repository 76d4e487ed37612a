#include "daemon/pipeline.h"

#include <array>
#include <atomic>
#include <string>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "core/frame_pool.h"
#include "core/latest_value.h"
#include "core/metrics.h"
#include "core/thread.h"
#include "core/wake_event.h"
#include "daemon/capture_stage.h"
#include "daemon/detection_stage.h"
#include "daemon/map_requests.h"
#include "daemon/map_saver.h"
#include "daemon/mapping_stage.h"
#include "daemon/publish_stage.h"
#include "daemon/stage_link.h"
#include "daemon/thread_config.h"
#include "daemon/tracking_stage.h"

namespace posed {

namespace {

std::size_t size_of(int configured) {
  return static_cast<std::size_t>(configured);
}

constexpr std::size_t kDetectionsQueue = 8;  // frames; a publisher that is further behind shows only the newest

/// What crosses threads, at its working size before they run.
struct Links {
  explicit Links(const Config& config)
      : frames(size_of(config.pipeline.frame_queue)),
        keyframes(size_of(config.pipeline.keyframe_queue)),
        estimates(size_of(config.pipeline.publish_queue)),
        detections(kDetectionsQueue) {
    keyframes.ring.prepare([&](KeyframeRecord& record) {
      record.reserve(feature_capacity(config.tracker.features), size_of(config.mapper.local_landmarks));
    });
    snapshots.prepare([&](MapSnapshot& snapshot) {
      snapshot.landmarks.reserve(size_of(config.mapper.local_landmarks));
      snapshot.anchors.reserve(size_of(config.mapper.max_keyframes));
      snapshot.keyframes.reserve(size_of(config.mapper.recovery_keyframes));
    });
  }

  void wake_all() noexcept {
    frames.wake_all();
    keyframes.wake_all();
    estimates.wake_all();
    newest_frame.wake();
    detections.wake_all();
  }

  FrameLink frames;
  NewestFrameLink newest_frame;
  KeyframeLink keyframes;
  LatestValue<MapSnapshot> snapshots;
  EstimateLink estimates;
  DetectionsLink detections;
  LatestValue<Detections> newest_detections;  // for the tracker
};

class Pipeline final : public App {
 public:
  Pipeline(const Config& config, AppOptions options, const Clock& clock, PipelineParts parts)
      : config_(config),
        parts_(std::move(parts)),
        pool_(parts_.source->info().width, parts_.source->info().height,
              size_of(config.pipeline.frame_slots) + parts_.source->info().slots_held),
        links_(config),
        gpio_(options.gpio),
        capture_(*parts_.source, pool_, std::move(options.on_source_error)),
        tracking_(*parts_.tracker, {links_.snapshots, links_.newest_detections, links_.keyframes, links_.estimates}, clock,
                  is_lockstep() ? FullQueue::Waits : FullQueue::DropsOldest, std::move(options.on_tracked)),
        saver_(*parts_.mapper, options.map_files.value_or(map_files(config.map)),
               is_lockstep() ? 0 : from_seconds(config.map.save_period_s), clock),
        mapping_(*parts_.mapper, links_.keyframes, links_.snapshots, saver_, clock),
        detection_(
            parts_.detector.get(), {links_.newest_frame, links_.detections, links_.newest_detections},
            [this] { links_.estimates.wake_all(); }, config.dynamic.lockstep_lag),
        publish_({links_.estimates, links_.detections}, make_publisher(clock),
                 {std::move(options.on_estimate), std::move(options.on_detections)}, clock) {}

  ~Pipeline() override {
    stop();
    parts_.source.reset();  // before the pool, whose slots it may hold
  }

  /// Before `start`.
  Status load_map() {
    return saver_.load().map([this](bool loaded) {
      if (loaded) {
        mapping_.publish_map();
      }
    });
  }

  const SourceInfo& source_info() const override { return parts_.source->info(); }

  Status start() override {
    if (started_) {
      return make_error(ErrorCode::InvalidArgument, "the pipeline was started before; it runs once");
    }
    started_ = true;
    try {
      start_threads();
    } catch (const std::system_error& error) {
      stop();
      return make_error(ErrorCode::Unavailable, fmt::format("a thread of the pipeline cannot start: {}", error.what()));
    }
    return {};
  }

  bool wait_finished(TimeNs timeout_ns) override {
    const SystemClock& clock = SystemClock::instance();
    const TimeNs deadline_ns = clock.now_ns() + timeout_ns;
    while (true) {
      const std::uint32_t seen = drained_event_.generation();
      if (estimates_drained_.load(std::memory_order_acquire) && keyframes_drained_.load(std::memory_order_acquire)) {
        return true;
      }
      const TimeNs left_ns = deadline_ns - clock.now_ns();
      if (left_ns <= 0) {
        return false;
      }
      drained_event_.wait(seen, left_ns);
    }
  }

  void stop() override {
    for (NamedThread& thread : threads_) {
      thread.request_stop();
    }
    links_.wake_all();
    for (NamedThread& thread : threads_) {
      thread.join();
    }
  }

  HealthReport health() const override {
    HealthReport health;
    capture_.report(health);
    tracking_.report(health);
    mapping_.report(health);
    detection_.report(health);
    publish_.report(health);
    if (gpio_ != nullptr) {
      health.gpio = gpio_->health();
    }
    health.peak_rss_bytes = peak_rss_bytes();
    return health;
  }

  void set_paused(bool paused) override { capture_.set_paused(paused && !is_lockstep()); }

  Status request_map_save() override {
    return saver_.can_save().map([this] {
      saver_.request();
      links_.keyframes.wake_all();
    });
  }

  std::optional<Se3> keyframe_pose(std::uint64_t keyframe) const override { return parts_.mapper->keyframe_pose(keyframe); }

 private:
  bool is_lockstep() const { return config_.source.pacing == Pacing::Lockstep; }

  std::unique_ptr<Publisher> make_publisher(const Clock& clock) {
    if (!parts_.transport) {
      return nullptr;
    }
    return std::make_unique<Publisher>(
        config_.publisher, config_.camera.T_base_camera, std::move(parts_.transport), clock, [this] { return health(); },
        make_map_requests(clock));
  }

  std::unique_ptr<MapRequests> make_map_requests(const Clock& clock) {
    if (!saver_.has_files()) {
      return nullptr;  // so that liblcm need not listen
    }
    return std::make_unique<MapRequests>(
        saver_, [this] { links_.keyframes.wake_all(); }, clock);
  }

  // Consumers before producers, so that the first frame finds everybody there.
  void start_threads() {
    const PipelineConfig& pipeline = config_.pipeline;
    threads_[0] = NamedThread(thread_options("publisher", pipeline.publisher), [this](const std::stop_token& stop) {
      publish_.run(stop, [this] { mark_drained(estimates_drained_); });
    });
    if (is_lockstep()) {
      threads_[1] =
          NamedThread(thread_options("tracker", pipeline.tracker), [this](const std::stop_token& stop) { run_lockstep(stop); });
      return;
    }
    threads_[1] = NamedThread(thread_options("mapper", pipeline.mapper), [this](const std::stop_token& stop) {
      mapping_.run(stop, [this] { mark_drained(keyframes_drained_); });
    });
    if (detection_.is_enabled()) {
      threads_[2] =
          NamedThread(thread_options("detector", pipeline.detector), [this](const std::stop_token& stop) { detection_.run(stop); });
    } else {
      detection_.close_output();
    }
    threads_[3] = NamedThread(thread_options("tracker", pipeline.tracker),
                              [this](const std::stop_token& stop) { tracking_.run(stop, links_.frames); });
    threads_[4] = NamedThread(thread_options("capture", pipeline.capture),
                              [this](const std::stop_token& stop) { capture_.run(stop, links_.frames, links_.newest_frame); });
  }

  /// Capture, detection, tracking and mapping in turn: the map that a frame is tracked against depends on the frames before it
  /// alone.
  void run_lockstep(const std::stop_token& stop) {
    bool more = capture_.begin();
    while (more && !stop.stop_requested()) {
      FrameRef frame;
      more = capture_.next(stop, frame);
      if (frame) {
        if (detection_.is_enabled()) {
          detection_.detect_unhurried(*frame, stop);
        }
        tracking_.track(*frame, stop);
        while (mapping_.step()) {
        }
      }
    }
    mapping_.finish(stop, [this] {
      mark_drained(keyframes_drained_);
      tracking_.close_outputs();
      detection_.close_output();
    });
  }

  void mark_drained(std::atomic<bool>& drained) {
    drained.store(true, std::memory_order_release);
    drained_event_.notify();
  }

  Config config_;
  PipelineParts parts_;
  FramePool pool_;
  Links links_;  // holds frames of the pool, so it goes before it

  const GpioLines* gpio_;
  CaptureStage capture_;
  TrackingStage tracking_;
  MapSaver saver_;
  MappingStage mapping_;
  DetectionStage detection_;
  PublishStage publish_;

  std::atomic<bool> estimates_drained_{false};
  std::atomic<bool> keyframes_drained_{false};
  WakeEvent drained_event_;

  bool started_ = false;
  std::array<NamedThread, 5> threads_;
};

Status check(const Config& config, const PipelineParts& parts) {
  const PipelineConfig& pipeline = config.pipeline;
  if (pipeline.frame_slots < 1 || pipeline.frame_queue < 1 || pipeline.keyframe_queue < 1 || pipeline.publish_queue < 1) {
    return make_error(ErrorCode::InvalidConfig,
                      "pipeline.frame_slots, frame_queue, keyframe_queue and publish_queue must each be at least 1");
  }
  // One frame is being filled and one tracked while the queue is full; others wait for the detector.
  const int needed = pipeline.frame_queue + 2 + (parts.detector ? NewestFrameLink::kFramesHeld : 0);
  if (pipeline.frame_slots < needed) {
    return make_error(ErrorCode::InvalidConfig,
                      fmt::format("pipeline.frame_slots is {}; with pipeline.frame_queue = {}{} at least {} are needed",
                                  pipeline.frame_slots, pipeline.frame_queue, parts.detector ? " and a detector" : "", needed));
  }
  const SourceInfo& info = parts.source->info();
  if (info.width < 1 || info.height < 1) {
    return make_error(ErrorCode::BadData,
                      fmt::format("{}: the source's frames are {} x {}", info.description, info.width, info.height));
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<App>> make_pipeline(const Config& config, AppOptions options, const Clock& clock, PipelineParts parts) {
  if (const Status checked = check(config, parts); !checked) {
    return tl::unexpected<Error>(checked.error());
  }
  auto pipeline = std::make_unique<Pipeline>(config, std::move(options), clock, std::move(parts));
  if (const Status loaded = pipeline->load_map(); !loaded) {
    return tl::unexpected<Error>(loaded.error());
  }
  return pipeline;
}

}  // namespace posed
