#include "tools/posectl/recorder.h"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "core/frame_pool.h"
#include "core/metrics.h"
#include "core/thread.h"
#include "core/wake_event.h"
#include "daemon/capture_stage.h"
#include "daemon/stage_link.h"

namespace posed {
namespace {

struct EncodedCell {
  Status status;
  EncodedFrame frame;
};

/// One encoding thread between its two links. The threads are served in turn, frame i by thread i modulo their number, so that the
/// writer gets the frames back in order without sorting and without a lock.
struct Lane {
  // The pool has no more frames than `queue`, so capturing finds room in the ring always.
  explicit Lane(std::size_t queue) : in(queue), out(queue) {}

  StageLink<BoundedRing<FrameRef>> in;
  StageLink<BoundedRing<EncodedCell>> out;
  NamedThread thread;
};

}  // namespace

class Recorder::Threads {
 public:
  Threads(std::unique_ptr<RgbdSource> source, std::vector<std::unique_ptr<FrameSink>> sinks, const RecorderOptions& options,
          SourceErrors& errors, const Clock& clock)
      : sinks_(std::move(sinks)),
        options_(options),
        clock_(clock),
        pool_(source->info().width, source->info().height, options.queue + source->info().slots_held),
        source_(std::move(source)),
        capture_(*source_, pool_, [&errors](const Error& error) { errors.add(error); }) {
    for (int i = 0; i < options.encoders; ++i) {
      lanes_.push_back(std::make_unique<Lane>(pool_.slots()));
    }
  }

  ~Threads() {
    // In this order: each thread ends by what the one before it has closed.
    request_stop();
    capture_thread_.join();
    for (const std::unique_ptr<Lane>& lane : lanes_) {
      lane->thread.join();
    }
    write_thread_.join();
  }

  void start() {
    write_thread_ = NamedThread({.name = "record-write"}, [this](const std::stop_token&) { write(); });
    for (std::size_t i = 0; i < lanes_.size(); ++i) {
      lanes_[i]->thread = NamedThread({.name = fmt::format("record-encode{}", i)},
                                      [this, &lane = *lanes_[i]](const std::stop_token&) { encode(lane); });
    }
    capture_thread_ = NamedThread({.name = "record-capture"}, [this](const std::stop_token&) { capture(); });
  }

  void request_stop() noexcept { stop_capture_.request_stop(); }

  bool wait_finished(TimeNs timeout_ns) noexcept {
    const std::uint32_t seen = finished_event_.generation();
    if (!finished_.load(std::memory_order_acquire)) {
      finished_event_.wait(seen, timeout_ns);
    }
    return finished_.load(std::memory_order_acquire);
  }

  RecorderReport report() const {
    HealthReport health;
    capture_.report(health);
    return {.captured = captured_.value(),
            .committed = committed_.value(),
            .dropped = health.frames_no_slot,
            .missed = health.frames_missed,
            .skipped = health.frames_skipped,
            .first_frame_ns = first_frame_ns_.value(),
            .source_failed = health.source_failed};
  }

  const Status& status() const { return status_; }

 private:
  void capture() {
    const std::stop_token stop = stop_capture_.get_token();
    bool more = capture_.begin();
    std::int64_t first_stamp_ns = 0;
    while (more && !stop.stop_requested()) {
      FrameRef frame;
      more = capture_.next(stop, frame);
      if (!frame) {
        continue;
      }
      if (captured_.value() == 0) {
        first_stamp_ns = frame->stamp_utc_ns;
        first_frame_ns_.set(clock_.now_ns());
      }
      if (options_.max_duration_ns > 0 && frame->stamp_utc_ns - first_stamp_ns >= options_.max_duration_ns) {
        break;
      }
      Lane& lane = *lanes_[captured_.value() % lanes_.size()];
      FrameRef* cell = lane.in.ring.claim();
      assert(cell != nullptr && "the ring is as large as the pool");
      *cell = std::move(frame);
      lane.in.ring.commit();
      lane.in.notify_arrived();
      captured_.add();
      more = more && (options_.max_frames == 0 || captured_.value() < options_.max_frames);
    }
    for (const std::unique_ptr<Lane>& lane : lanes_) {
      lane->in.close();
    }
  }

  void encode(Lane& lane) {
    const std::stop_token abort = abort_.get_token();
    lane.in.consume(abort, [&] {
      FrameRef* queued = lane.in.ring.front();
      if (queued == nullptr || !lane.out.wait_for_room(abort)) {
        return false;
      }
      const FrameRef frame = std::move(*queued);
      lane.in.ring.release();  // before the frame's slot is free, so that the ring has room for whatever takes it
      EncodedCell& cell = *lane.out.ring.claim();
      cell.status = encode_frame(*frame, options_.encoding, cell.frame);
      lane.out.ring.commit();
      lane.out.notify_arrived();
      return true;
    });
    lane.out.close();
  }

  void write() {
    Status status;
    while (status) {
      Lane& lane = *lanes_[written_ % lanes_.size()];
      const std::uint32_t seen = lane.out.generation();
      const bool was_closed = lane.out.is_closed();
      if (EncodedCell* cell = lane.out.ring.front()) {
        status = add(*cell);
        lane.out.ring.release();
        lane.out.notify_taken();
      } else if (was_closed) {
        break;
      } else {
        const TimeNs patience_ns = written_ > committed_.value() ? commit_due_ns_ - clock_.now_ns() : kNsPerSecond;
        lane.out.wait_arrived(seen, std::max<TimeNs>(patience_ns, 0));
      }
      if (status && written_ > committed_.value() && clock_.now_ns() >= commit_due_ns_) {
        status = commit();
      }
    }
    const Status last = commit();  // after an error, too: it keeps what was written before
    status_ = status ? last : status;
    end();
  }

  Status add(const EncodedCell& cell) {
    Status status = cell.status;
    for (const std::unique_ptr<FrameSink>& sink : sinks_) {
      status = status ? sink->add(cell.frame) : status;
    }
    if (status && written_++ == committed_.value()) {
      commit_due_ns_ = clock_.now_ns() + options_.commit_period_ns;
    }
    return status;
  }

  /// Every sink keeps what it can, also where another one fails.
  Status commit() {
    Status status;
    for (const std::unique_ptr<FrameSink>& sink : sinks_) {
      const Status committed = sink->commit();
      status = status ? committed : status;
    }
    if (status) {
      committed_.add(written_ - committed_.value());
    }
    return status;
  }

  /// Lets the other threads end, which they do by themselves but for an error here.
  void end() {
    stop_capture_.request_stop();
    abort_.request_stop();
    for (const std::unique_ptr<Lane>& lane : lanes_) {
      lane->in.wake_all();
      lane->out.wake_all();
    }
    finished_.store(true, std::memory_order_release);
    finished_event_.notify();
  }

  std::vector<std::unique_ptr<FrameSink>> sinks_;
  const RecorderOptions options_;
  const Clock& clock_;
  FramePool pool_;
  std::unique_ptr<RgbdSource> source_;  // goes before the pool does
  CaptureStage capture_;
  std::vector<std::unique_ptr<Lane>> lanes_;

  Counter captured_;
  Counter committed_;
  Gauge first_frame_ns_;
  std::uint64_t written_ = 0;  // the writing thread's, like the next two
  TimeNs commit_due_ns_ = 0;
  Status status_;  // read by others after `finished_`
  std::atomic<bool> finished_{false};
  WakeEvent finished_event_;
  std::stop_source stop_capture_;
  std::stop_source abort_;
  NamedThread capture_thread_;
  NamedThread write_thread_;
};

Recorder::Recorder(std::unique_ptr<RgbdSource> source, std::vector<std::unique_ptr<FrameSink>> sinks,
                   const RecorderOptions& options, SourceErrors& errors, const Clock& clock)
    : threads_(std::make_unique<Threads>(std::move(source), std::move(sinks), options, errors, clock)) {}

Recorder::~Recorder() = default;

void Recorder::start() {
  threads_->start();
}

void Recorder::request_stop() noexcept {
  threads_->request_stop();
}

bool Recorder::wait_finished(TimeNs timeout_ns) noexcept {
  return threads_->wait_finished(timeout_ns);
}

RecorderReport Recorder::report() const {
  return threads_->report();
}

const Status& Recorder::status() const {
  return threads_->status();
}

}  // namespace posed
