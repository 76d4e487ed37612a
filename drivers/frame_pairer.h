#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/clock.h"
#include "core/rgbd_frame.h"

namespace posed {

enum class PairSide : std::uint8_t { Color, Depth };

/// An image that waits for its partner. What it is kept in is its owner's affair, who knows it by `buffer`.
struct UnpairedImage {
  TimeNs capture_ns = 0;
  std::uint64_t sequence = 0;
  std::uint32_t buffer = 0;
};

struct FramePairerOptions {
  TimeNs max_difference_ns = 16 * kNsPerMs;                    ///< of the stamps of a pair
  std::array<TimeNs, 2> period_ns = {33'333'333, 33'333'333};  ///< between images of each side, by PairSide
  std::array<std::size_t, 2> capacity = {2, 2};                ///< images of each side that may wait; at most kMost
};

/// Finds the images of two cameras that were taken at one time. A new image goes with the nearest one that waits on the other side;
/// but where that is older by more than half the other side's period, the other side's next image will be nearer, and the new one
/// waits for it. What is older than a pair is let go, and so is the oldest where too many wait. Thread-bound. Does not allocate.
class FramePairer {
 public:
  static constexpr std::size_t kMost = 8;

  struct Discarded {
    PairSide side = PairSide::Color;
    UnpairedImage image;
  };
  struct Outcome {
    bool paired = false;
    UnpairedImage color;  ///< of a pair
    UnpairedImage depth;
    std::array<Discarded, 2 * kMost> let_go;  ///< for want of a partner; to be given back to their owners
    std::size_t let_go_count = 0;
    std::span<const Discarded> discarded() const { return {let_go.data(), let_go_count}; }

    /// Writes when a pair's images were taken, and as `sequence` what the `counted` side counts.
    void stamp(RgbdFrame& frame, PairSide counted) const;
  };

  explicit FramePairer(const FramePairerOptions& options) : options_(options) {}

  /// Each side's stamps increase; where one goes back, that side begins anew.
  Outcome add(PairSide side, const UnpairedImage& image);

  /// Forgets all that waits: their owners have been closed.
  void clear();

 private:
  class Queue {
   public:
    std::size_t size() const { return size_; }
    const UnpairedImage& operator[](std::size_t i) const { return images_[i]; }
    void push(const UnpairedImage& image) { images_[size_++] = image; }
    void pop_front(std::size_t count);

   private:
    std::array<UnpairedImage, kMost> images_{};  // oldest first
    std::size_t size_ = 0;
  };

  void let_go(PairSide side, std::size_t count, Outcome& outcome);
  std::optional<std::size_t> partner_of(const UnpairedImage& image, PairSide other) const;

  FramePairerOptions options_;
  std::array<Queue, 2> waiting_;  // by PairSide
};

}  // namespace posed
