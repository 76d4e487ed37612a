#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/clock.h"
#include "core/result.h"
#include "drivers/encoded_frame.h"
#include "drivers/rgbd_source.h"
#include "tools/posectl/frame_sink.h"
#include "tools/posectl/source_errors.h"

namespace posed {

struct RecorderOptions {
  EncodingOptions encoding;
  int encoders = 1;                          ///< threads that make image files, >= 1
  std::size_t queue = 32;                    ///< frames that may wait to be encoded, and as many to be written, >= 1
  TimeNs commit_period_ns = 500 * kNsPerMs;  ///< longest time that a written frame waits for its commit
  std::uint64_t max_frames = 0;              ///< 0: all
  TimeNs max_duration_ns = 0;                ///< by the frames' stamps; 0: all
};

/// What has become of the source's frames. Plain data.
struct RecorderReport {
  std::uint64_t captured = 0;   ///< taken from the source to be written
  std::uint64_t committed = 0;  ///< of these, those that every sink has committed: they outlast a kill and a power cut
  std::uint64_t dropped = 0;    ///< lost because encoding and writing were too slow
  std::uint64_t missed = 0;     ///< gaps in the source's count that nothing here explains
  std::uint64_t skipped = 0;    ///< bad frames of the source
  TimeNs first_frame_ns = 0;    ///< when the first one came; 0: none did yet
  bool source_failed = false;   ///< SourceErrors::last says why
};

/// Writes a source's frames to sinks: one thread captures, some encode, one writes and commits. Capturing never waits for the disk:
/// frames wait in a pool, and where it is exhausted the source drops the frame, which is counted (a source in lockstep waits
/// instead). Frames reach the sinks in the order of capture. Thread-safe, but for the constructor, `start` and the destructor,
/// which stops it.
class Recorder {
 public:
  /// `errors` and `clock` must outlive the recorder.
  Recorder(std::unique_ptr<RgbdSource> source, std::vector<std::unique_ptr<FrameSink>> sinks, const RecorderOptions& options,
           SourceErrors& errors, const Clock& clock);
  ~Recorder();

  void start();

  /// Ends capturing; what was captured is still written.
  void request_stop() noexcept;

  /// Waits at most `timeout_ns` for everything to be written; true where it is. It ends by itself where the source ends or fails,
  /// where the options' limits are reached, and where a sink fails.
  bool wait_finished(TimeNs timeout_ns) noexcept;

  RecorderReport report() const;

  /// The error of the sink that failed, if any. After `wait_finished`.
  const Status& status() const;

 private:
  class Threads;
  std::unique_ptr<Threads> threads_;
};

}  // namespace posed
