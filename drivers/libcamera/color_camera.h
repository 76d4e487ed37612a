#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "core/clock.h"
#include "core/result.h"
#include "drivers/libcamera/color_image.h"

/// What posed asks of libcamera, without a type of it, so that tests can stand in for it.
namespace posed {

/// What became of one request.
struct CompletedImage {
  enum class Kind : std::uint8_t {
    Filled,
    Damaged,    ///< the camera says that the image is not to be used
    Cancelled,  ///< the camera has stopped
  };
  Kind kind = Kind::Filled;
  std::uint32_t buffer = 0;
  std::uint64_t sequence = 0;  ///< the camera's count, whose gaps are images lost
  TimeNs stamp_ns = 0;         ///< the camera's; 0: it has none
  TimeNs arrival_ns = 0;       ///< monotonic: when it was told
  std::size_t bytes_used = 0;  ///< of the first plane
};

/// Hears of a camera on libcamera's own thread. Neither allocates nor blocks.
class CompletionSink {
 public:
  virtual void on_completed(const CompletedImage& image) noexcept = 0;
  virtual void on_disconnected() noexcept = 0;

 protected:
  ~CompletionSink() = default;
};

/// A colour camera whose images come in buffers of its own. Thread-bound. No exception leaves it.
class ColorCamera {
 public:
  virtual ~ColorCamera() = default;

  virtual const std::string& description() const = 0;  ///< for people: "libcamera camera, first one found"

  /// Finds the camera, agrees on the format and starts with all buffers given to it. Closed again where that fails, with the errors
  /// that Camera::open has.
  virtual Status open(CompletionSink& sink) = 0;

  /// Stops; what is in flight is cancelled, and the sink hears nothing once this has returned.
  virtual void close() noexcept = 0;

  /// While it is open.
  virtual const ColorFormat& format() const = 0;
  virtual TimeNs period_ns() const = 0;  ///< between images, as agreed
  virtual std::size_t buffers() const = 0;

  /// Where the pixels of a completed image are, until it is given back.
  virtual ColorPlanes planes(std::uint32_t buffer) const = 0;

  /// Lets the camera fill the buffer again. Does not allocate on our side.
  virtual Status give_back(std::uint32_t buffer) = 0;
};

}  // namespace posed
