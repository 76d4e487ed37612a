#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/clock.h"
#include "drivers/libcamera/color_camera.h"

namespace posed::test {

/// What becomes of one image.
struct ColorFate {
  bool dropped = false;  ///< never seen, but counted
  CompletedImage::Kind kind = CompletedImage::Kind::Filled;
};

/// A camera as libcamera shows one, in a test's hands. BGR images whose bytes are all their number. Notes each misuse.
/// Thread-bound: what libcamera's thread would do happens in `run`.
class FakeColorCamera {
 public:
  FakeColorCamera(const Clock& clock, int width, int height);

  bool present = true;
  double rate_hz = 30;
  std::size_t buffers = 4;
  TimeNs delay_ns = 3 * kNsPerMs;  ///< from an image's stamp to its completion
  TimeNs clock_offset_ns = 0;      ///< its stamps less the monotonic clock
  TimeNs silent_until_ns = 0;      ///< images before are lost, and counted
  std::optional<Error> give_back_error;
  std::function<ColorFate(std::uint64_t)> fate = [](std::uint64_t) { return ColorFate{}; };

  /// To be given to the driver under test; this outlives it.
  std::unique_ptr<ColorCamera> handle();

  /// Completes what is due.
  void run();
  TimeNs next_ns() const;  ///< when the next image completes

  /// As when its plug is pulled.
  void disconnect();

  int opened() const { return opened_; }
  bool is_open() const { return sink_ != nullptr; }
  std::size_t queued() const { return queued_.size(); }
  const std::vector<std::string>& violations() const { return violations_; }

 private:
  class Handle;

  TimeNs period_ns() const { return from_seconds(1.0 / rate_hz); }
  void violation(const char* text) { violations_.emplace_back(text); }

  const Clock& clock_;
  ColorFormat format_;
  CompletionSink* sink_ = nullptr;
  std::vector<std::vector<std::uint8_t>> memory_;  // by buffer
  std::vector<std::uint32_t> queued_;              // oldest first
  std::vector<bool> is_queued_;
  std::uint64_t sequence_ = 0;
  TimeNs next_stamp_ns_ = 0;
  int opened_ = 0;
  std::vector<std::string> violations_;
};

}  // namespace posed::test
