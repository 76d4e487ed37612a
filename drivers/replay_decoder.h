#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <stop_token>

#include "core/bounded_ring.h"
#include "core/clock.h"
#include "core/frame_pool.h"
#include "core/thread.h"
#include "core/wake_event.h"
#include "drivers/image_file.h"
#include "drivers/rgbd_source.h"
#include "drivers/tum_sequence.h"

namespace posed {

/// What becomes of one pair of images, in the order of the recording.
struct ReplayItem {
  CaptureKind kind = CaptureKind::EndOfStream;  ///< Frame, SkippedFrame, NoFreeSlot, EndOfStream or Failed
  TimeNs elapsed_ns = 0;             ///< stamp since that of the first pair; it keeps growing when the recording begins again
  std::optional<FrameWriter> frame;  ///< complete but for `capture_ns`
  Error error;
};

struct ReplayDecoderOptions {
  double depth_units_per_metre = 5000.0;
  std::size_t decode_ahead = 4;  ///< items
  bool loop = false;
  bool wait_for_slots = false;  ///< however long; otherwise a frame that has no slot when it is due is lost
};

/// Decodes a recording on a thread of its own, named "decode", a bounded number of frames ahead. The thread runs with the normal
/// policy on the processors of the thread that constructs it. `front`, `release` and `begin` belong to one consumer thread.
class ReplayDecoder {
 public:
  /// Starts decoding. `sequence`, `pool` and `clock` must outlive this object.
  ReplayDecoder(const TumSequence& sequence, const ReplayDecoderOptions& options, FramePool& pool, const Clock& clock);
  ~ReplayDecoder();
  ReplayDecoder(const ReplayDecoder&) = delete;
  ReplayDecoder& operator=(const ReplayDecoder&) = delete;

  /// Waits for the next item; null where `stop` was triggered first. It stays until `release`; the last one, EndOfStream or Failed,
  /// stays for good.
  ReplayItem* front(std::stop_token stop);
  void release();

  /// Says when the pair with `elapsed_ns` 0 is due, which decides when a frame without a slot is lost; until then none is.
  void begin(TimeNs start_ns) { start_ns_.store(start_ns, std::memory_order_release); }

 private:
  static constexpr TimeNs kNotBegun = -1;

  void run(std::stop_token stop);
  bool run_pass(std::uint64_t pass, std::stop_token stop);
  void decode(std::uint64_t pass, std::size_t index, ReplayItem& item, std::stop_token stop);
  Status decode_images(const TumAssociation& pair, RgbdFrame& frame);
  void finish(ReplayItem& item, CaptureKind kind, Error error);
  ReplayItem* wait_for_room(std::stop_token stop);
  std::optional<FrameWriter> wait_for_slot(TimeNs elapsed_ns, std::stop_token stop);

  const TumSequence& sequence_;
  const ReplayDecoderOptions options_;
  FramePool& pool_;
  const Clock& clock_;
  ImageDecoder images_;  // decoding thread's own
  BoundedRing<ReplayItem> ring_;
  WakeEvent decoded_;
  WakeEvent taken_;
  std::atomic<TimeNs> start_ns_{kNotBegun};
  NamedThread thread_;  // last: it uses the others
};

}  // namespace posed
