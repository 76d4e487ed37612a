#include "daemon/supervisor.h"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <systemd/sd-daemon.h>
#include <systemd/sd-event.h>

#include "core/logging.h"

namespace posed {

namespace {

void notify_systemd(const std::string& state) {
  sd_notify(0, state.c_str());
}  // does nothing without $NOTIFY_SOCKET

// A library may have started threads before main (OpenBLAS does, where it stands in for the BLAS that OpenCV links). They do not
// block our signals, and the kernel may hand them one.
pthread_t event_thread;

extern "C" void forward_to_event_thread(int signal) {
  pthread_kill(event_thread, signal);
}

}  // namespace

/// sd-event with what the daemon waits for: a signal that ends it, the signal to save the map, and the time to look.
class Supervisor::EventLoop {
 public:
  EventLoop(TimeNs period_ns, std::function<bool()> look, std::function<void()> save_map, std::function<void()> reload)
      : period_us_(static_cast<std::uint64_t>(period_ns / kNsPerUs)),
        look_(std::move(look)),
        save_map_(std::move(save_map)),
        reload_(std::move(reload)) {}

  /// The signal that ended the loop, or 0 where `look` did.
  Result<int> run() {
    sd_event* event = nullptr;
    int status = sd_event_new(&event);
    const std::unique_ptr<sd_event, decltype(&sd_event_unref)> owner(event, sd_event_unref);
    for (const int signal : {SIGINT, SIGTERM}) {
      if (status >= 0) {
        status = sd_event_add_signal(event, nullptr, signal, &EventLoop::on_signal, nullptr);
      }
    }
    if (status >= 0) {
      status = sd_event_add_signal(event, nullptr, SIGUSR1, &EventLoop::on_save_signal, this);
    }
    if (status >= 0) {
      status = sd_event_add_signal(event, nullptr, SIGHUP, &EventLoop::on_reload_signal, this);
    }
    if (status >= 0) {
      status = sd_event_add_time_relative(event, nullptr, CLOCK_MONOTONIC, period_us_, kAccuracyUs, &EventLoop::on_time, this);
    }
    if (status >= 0) {
      status = sd_event_loop(event);
    }
    if (status < 0) {
      return make_error(ErrorCode::Unavailable, fmt::format("the event loop failed: {}", std::strerror(-status)));
    }
    return status;
  }

 private:
  static constexpr std::uint64_t kAccuracyUs = 10'000;

  static int on_signal(sd_event_source* source, const signalfd_siginfo* info, void*) {
    return sd_event_exit(sd_event_source_get_event(source), static_cast<int>(info->ssi_signo));
  }

  static int on_save_signal(sd_event_source*, const signalfd_siginfo*, void* self) {
    static_cast<EventLoop*>(self)->save_map_();
    return 0;
  }

  static int on_reload_signal(sd_event_source*, const signalfd_siginfo*, void* self) {
    static_cast<EventLoop*>(self)->reload_();
    return 0;
  }

  static int on_time(sd_event_source* source, std::uint64_t, void* self) {
    auto* const loop = static_cast<EventLoop*>(self);
    if (loop->look_()) {
      return sd_event_exit(sd_event_source_get_event(source), 0);
    }
    const int status = sd_event_source_set_time_relative(source, loop->period_us_);
    return status < 0 ? status : sd_event_source_set_enabled(source, SD_EVENT_ONESHOT);
  }

  std::uint64_t period_us_;
  std::function<bool()> look_;
  std::function<void()> save_map_;
  std::function<void()> reload_;
};

std::function<void(const Error&)> Supervisor::ErrorQueue::sink() {
  return [this](const Error& error) {
    if (ring.push(error)) {
      dropped.add();
    }
  };
}

void Supervisor::ErrorQueue::log(const char* origin) {
  while (const std::optional<Error> error = ring.pop()) {
    log_warning("{}: {}", origin, error->message);
  }
  const std::uint64_t now_dropped = dropped.value();
  if (now_dropped != dropped_logged) {
    log_warning("{}: {} more errors, too fast to log them", origin, now_dropped - dropped_logged);
    dropped_logged = now_dropped;
  }
}

Supervisor::Supervisor(SupervisorOptions options) : options_(options) {}

Status Supervisor::block_signals() {
  event_thread = pthread_self();
  struct sigaction forward {};
  forward.sa_handler = forward_to_event_thread;
  forward.sa_flags = SA_RESTART;
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM, SIGUSR1, SIGHUP}) {
    sigaddset(&signals, signal);
    if (sigaction(signal, &forward, nullptr) != 0) {
      return make_error(ErrorCode::Unavailable, fmt::format("signal {} cannot be handled: {}", signal, std::strerror(errno)));
    }
  }
  if (const int error = pthread_sigmask(SIG_BLOCK, &signals, nullptr); error != 0) {
    return make_error(ErrorCode::Unavailable, fmt::format("the signals cannot be blocked: {}", std::strerror(error)));
  }
  return {};
}

std::function<void(const Error&)> Supervisor::source_error_sink() {
  return source_errors_.sink();
}

std::function<void(const Error&)> Supervisor::gpio_error_sink() {
  return gpio_errors_.sink();
}

Result<RunEnd> Supervisor::run(App& app, GpioLines* gpio) {
  if (gpio != nullptr) {
    app.set_paused(!gpio->enabled());
  }
  if (const Status started = app.start(); !started) {
    return tl::unexpected<Error>(started.error());
  }
  log_info("running: {}", app.source_info().description);
  std::uint64_t watchdog_us = 0;
  watchdog_ = sd_watchdog_enabled(0, &watchdog_us) > 0;
  TimeNs period_ns = options_.poll_period_ns;
  if (watchdog_) {
    period_ns = std::min(period_ns, static_cast<TimeNs>(watchdog_us) * kNsPerUs / 3);
  }
  last_log_ns_ = SystemClock::instance().now_ns();
  next_health_log_ns_ = last_log_ns_ + options_.health_log_period_ns;

  EventLoop loop(
      period_ns, [&] { return look(app, gpio); }, [&] { save_map(app); }, [&] { reload(app); });
  const Result<int> ended_by = loop.run();

  notify_systemd("STOPPING=1\nSTATUS=stopping");
  if (ended_by && *ended_by != 0) {
    log_info("stopping: {}", *ended_by == SIGINT ? "SIGINT" : "SIGTERM");
  }
  app.stop();
  source_errors_.log("source");
  gpio_errors_.log("gpio");
  const HealthReport health = app.health();
  log_health(health);
  if (!ended_by) {
    return tl::unexpected<Error>(ended_by.error());
  }
  if (*ended_by != 0) {
    return RunEnd::Signal;
  }
  return health.source_failed ? RunEnd::SourceFailed : RunEnd::SourceEnded;
}

bool Supervisor::look(App& app, GpioLines* gpio) {
  source_errors_.log("source");
  gpio_errors_.log("gpio");
  if (gpio != nullptr) {
    work_lines(app, *gpio);
  }
  const HealthReport health = app.health();
  watch_progress(health);
  if (!ready_ &&
      (health.frames_tracked + health.frames_lost > 0 || !health.source.connected || health.source_ended || health.paused)) {
    notify_ready(app.source_info().description);
  }
  const TimeNs now_ns = SystemClock::instance().now_ns();
  if (!looked_ || health.state != state_) {
    looked_ = true;
    state_ = health.state;
    log_info("state: {}", to_string(state_));
    notify_systemd(fmt::format("STATUS={}", to_string(state_)));
  }
  if (health.source.connected != source_connected_) {
    source_connected_ = health.source.connected;
    log_info("source: {}", source_connected_ ? "frames come" : "no frames; waiting for the camera");
  }
  if (now_ns >= next_health_log_ns_) {
    log_health(health);
    next_health_log_ns_ = now_ns + options_.health_log_period_ns;
  }
  if (!source_done_ && app.wait_finished(0)) {
    source_done_ = true;
    log_info("the source has {}; every frame is processed", health.source_failed ? "failed" : "ended");
  }
  return source_done_ && options_.exit_at_end;
}

void Supervisor::work_lines(App& app, GpioLines& gpio) {
  app.set_paused(!gpio.enabled());
  const HealthReport health = app.health();
  gpio.show(light_state(health));
  if (health.paused != paused_) {
    paused_ = health.paused;
    log_info("{}", paused_ ? "paused by the enable line" : "running: the enable line is active");
  }
  if (health.gpio.ok != lines_held_) {
    lines_held_ = health.gpio.ok;
    log_info("gpio: {}", lines_held_ ? "every line is held" : "waiting for a line");
  }
}

void Supervisor::reload(App& app) {
  notify_systemd("RELOADING=1");
  if (options_.reload) {
    options_.reload(app);
  } else {
    log_warning("SIGHUP: there is no configuration file to read again");
  }
  notify_systemd("READY=1");
}

void Supervisor::notify_ready(const std::string& source) {
  ready_ = true;
  notify_systemd("READY=1\nSTATUS=running: " + source);
}

void Supervisor::watch_progress(const HealthReport& health) {
  for (const ProgressWatch::Change& change : progress_.look(health.progress)) {
    if (change.stuck) {
      log_warning("the {} thread has been at one thing for {:.1f} s", change.thread, to_seconds(change.silent_ns));
    } else {
      log_warning("the {} thread moves again", change.thread);
    }
  }
  if (watchdog_ && progress_.makes_progress()) {
    notify_systemd("WATCHDOG=1");
  }
}

void Supervisor::save_map(App& app) {
  if (const Status requested = app.request_map_save(); !requested) {
    log_warning("SIGUSR1: {}", requested.error().message);
  }
}

void Supervisor::log_health(const HealthReport& health) {
  const TimeNs now_ns = SystemClock::instance().now_ns();
  const std::uint64_t frames = health.frames_tracked + health.frames_lost;
  const double elapsed_s = to_seconds(now_ns - last_log_ns_);
  const double rate_hz = elapsed_s > 0 ? static_cast<double>(frames - frames_at_last_log_) / elapsed_s : 0;
  const std::string line = describe(health, rate_hz);
  log_info("{}", line);
  notify_systemd("STATUS=" + line);
  last_log_ns_ = now_ns;
  frames_at_last_log_ = frames;
}

LightState light_state(const HealthReport& health) {
  if (health.paused) {
    return LightState::Paused;
  }
  if (!health.source.connected || health.source_failed) {
    return LightState::WaitingForCamera;
  }
  switch (health.state) {
    case TrackingState::Initializing: return LightState::Initializing;
    case TrackingState::Tracking: return LightState::Tracking;
    case TrackingState::Lost:
    case TrackingState::Relocalizing: return LightState::Lost;
  }
  return LightState::Lost;
}

std::string describe(const HealthReport& health, double rate_hz) {
  const std::uint64_t lost_before_tracker =
      health.frames_missed + health.frames_skipped + health.frames_no_slot + health.frames_dropped;
  std::string line = fmt::format(
      "{}{}{}, {:.1f} frames/s; frames tracked {}, lost {}, not processed {}; poses published {}, dropped {}, errors {}; track p50 "
      "{:.1f} ms p99 {:.1f} ms; capture to publish p50 {:.1f} ms p99 {:.1f} ms; map {} keyframes, {} landmarks; page faults "
      "capture {}, tracker {}",
      to_string(health.state), health.paused ? ", paused" : "",
      health.source_failed      ? ", source failed"
      : health.source.connected ? ""
                                : ", waiting for the camera",
      rate_hz, health.frames_tracked, health.frames_lost, lost_before_tracker, health.poses_published, health.poses_dropped,
      health.publish_errors, health.track.p50_ms, health.track.p99_ms, health.latency.p50_ms, health.latency.p99_ms,
      health.map_keyframes, health.map_landmarks, health.capture_page_faults, health.tracker_page_faults);
  if (health.source.reconnects + health.source.stalls > 0) {
    line += fmt::format("; camera back {} times, silent {} times", health.source.reconnects, health.source.stalls);
  }
  if (health.source.clock_resets > 0) {
    line += fmt::format("; its clock began anew {} times", health.source.clock_resets);
  }
  if (health.frames_paused > 0) {
    line += fmt::format("; frames let go while paused {}", health.frames_paused);
  }
  if (!health.gpio.ok) {
    line += "; a GPIO line is missing";
  }
  if (health.gpio.trigger_pulses > 0) {
    line += fmt::format("; trigger pulses {}, missed {}, at most {:.3f} ms late", health.gpio.trigger_pulses,
                        health.gpio.trigger_missed, to_ms(health.gpio.worst_trigger_lateness_ns));
  }
  if (!health.detector_model.empty()) {
    line += fmt::format("; people looked for in {} frames by {}, p50 {:.1f} ms p99 {:.1f} ms, {} given up", health.detected,
                        health.detector_model, health.detect.p50_ms, health.detect.p99_ms, health.detections_abandoned);
  }
  return line;
}

}  // namespace posed
