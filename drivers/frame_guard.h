#pragma once

#include <optional>
#include <string>

#include "core/clock.h"
#include "core/frame_pool.h"

namespace posed {

/// Looks at what a camera delivers before anybody else does, and keeps out what would make a wrong pose: stamps that do not
/// increase or lie in the future, and a camera that repeats one image for ever (a real one's noise never does; a covered
/// one, which sees no depth, does, and its frames tell the tracker that it is lost). Holds one frame of
/// the pool. Thread-bound. Allocates only where it refuses.
class FrameGuard {
 public:
  static constexpr TimeNs kFuture_ns = 5 * kNsPerMs;  ///< a stamp may be ahead of the clock by so much
  static constexpr int kRepeatsAllowed = 2;           ///< in a row; some cameras repeat an image when it is dark

  /// Why `frame` must be left out, at `now_ns`; nothing where it may be used.
  std::optional<std::string> judge(const RgbdFrame& frame, TimeNs now_ns);

  /// A frame that was handed on: the next are compared with it.
  void remember(FrameRef frame) { last_ = std::move(frame); }

  /// The camera was opened again: what it showed before says nothing of what it shows now. Stamps go on.
  void forget_image() {
    last_ = FrameRef();
    repeats_ = 0;
  }

 private:
  FrameRef last_;
  std::optional<TimeNs> last_capture_ns_;  // of the last good frame
  int repeats_ = 0;
};

}  // namespace posed
