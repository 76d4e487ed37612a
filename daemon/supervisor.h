#pragma once

#include <functional>
#include <string>

#include "core/clock.h"
#include "core/metrics.h"
#include "core/overflow_ring.h"
#include "core/result.h"
#include "daemon/app.h"
#include "drivers/gpio_lines.h"

namespace posed {

struct SupervisorOptions {
  bool exit_at_end = false;  ///< end when the source has ended or failed; otherwise a signal alone ends it
  TimeNs poll_period_ns = 200 * kNsPerMs;
  TimeNs health_log_period_ns = 30 * kNsPerSecond;
};

/// Why a run ended.
enum class RunEnd { Signal, SourceEnded, SourceFailed };

/// The main thread's part: runs the pipeline under sd-event until a signal (SIGINT, SIGTERM) or the end of the source, has the map
/// saved on SIGUSR1, writes the
/// log that the pipeline's threads must not write, and tells systemd how things stand where $NOTIFY_SOCKET is set. Thread-bound to
/// the main thread. Must outlive the App and the GpioLines that were given its sinks.
class Supervisor {
 public:
  explicit Supervisor(SupervisorOptions options);

  /// Blocks the signals that the daemon acts on in the calling thread and those it starts, so that the event loop alone receives
  /// them: call it before the daemon starts any thread. Threads that libraries have started before main pass theirs on.
  static Status block_signals();

  /// For AppOptions::on_source_error: passes errors from the capture thread to the log without waiting for the log.
  std::function<void(const Error&)> source_error_sink();

  /// The same for make_gpio_lines and its thread.
  std::function<void(const Error&)> gpio_error_sink();

  /// Starts `app`, runs until the end and stops it. `gpio`, where there is one, shows the state and pauses `app`. Error:
  /// Unavailable, where the event loop or a thread cannot be set up.
  Result<RunEnd> run(App& app, GpioLines* gpio = nullptr);

 private:
  class EventLoop;

  /// Carries one thread's errors to the log; what comes too fast to be logged is counted.
  struct ErrorQueue {
    OverflowRing<Error> ring{16};  // between two looks
    Counter dropped;
    std::uint64_t dropped_logged = 0;

    std::function<void(const Error&)> sink();
    void log(const char* origin);
  };

  /// Logs what happened since the last look; true where the run has come to its end.
  bool look(App& app, GpioLines* gpio);
  void work_lines(App& app, GpioLines& gpio);
  static void save_map(App& app);
  void log_health(const HealthReport& health);

  SupervisorOptions options_;
  ErrorQueue source_errors_;
  ErrorQueue gpio_errors_;

  bool looked_ = false;
  TrackingState state_ = TrackingState::Initializing;
  bool source_connected_ = true;
  bool paused_ = false;
  bool lines_held_ = true;
  bool source_done_ = false;
  TimeNs next_health_log_ns_ = 0;
  std::uint64_t frames_at_last_log_ = 0;
  TimeNs last_log_ns_ = 0;
};

/// What the status light shows of a report. Reentrant.
LightState light_state(const HealthReport& health);

/// One line for people: state, rate, latencies, losses, map. `rate_hz` is of frames processed. Reentrant.
std::string describe(const HealthReport& health, double rate_hz);

}  // namespace posed
