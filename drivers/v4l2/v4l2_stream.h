#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "config/camera_source_config.h"
#include "core/clock.h"
#include "core/result.h"
#include "drivers/camera.h"
#include "drivers/v4l2/v4l2_negotiation.h"
#include "drivers/v4l2/v4l2_stamps.h"

namespace posed {

/// An image in one of the stream's buffers: nothing is copied. Valid until it is given back or the stream is closed.
struct V4l2Image {
  std::span<const std::uint8_t> bytes;
  TimeNs capture_ns = 0;
  std::uint64_t sequence = 0;  ///< the driver's count since the stream was opened, whose gaps are images lost
  std::uint32_t buffer = 0;
};

struct V4l2Take {
  CameraReadKind kind = CameraReadKind::Nothing;  ///< never End
  V4l2Image image;                                ///< of a Frame
  Error error;
};

/// The images of one V4L2 node by mapped buffers (single-planar, so each could be exported as a DMABUF). Thread-bound.
class V4l2Stream {
 public:
  V4l2Stream(V4l2System& system, const Clock& clock, const V4l2Config& config, const V4l2Request& request);
  ~V4l2Stream() { close(); }
  V4l2Stream(const V4l2Stream&) = delete;
  V4l2Stream& operator=(const V4l2Stream&) = delete;

  /// Opens the node, agrees on format and rate, sets the controls and starts. Closed again where that fails, with the errors that
  /// Camera::open has.
  Status open();
  void close() noexcept;

  /// The oldest image that waits; never blocks: `descriptor` is readable where there is one. An image that the driver flags as bad
  /// or has not filled is a BadFrame, and so is one whose stamp is not later than the last. Does not allocate but for errors.
  V4l2Take take();

  /// `take` after waiting at most `timeout_ns`.
  V4l2Take wait(TimeNs timeout_ns);

  /// Lets the driver fill the buffer again. An error is told by the next `take`.
  void give_back(std::uint32_t buffer);
  V4l2Image image_in(std::uint32_t buffer) const;  ///< the one that was taken and is not given back

  /// What poll said of the descriptor, to be told by the next `take`.
  void note_poll(short revents);

  int descriptor() const { return device_.descriptor(); }  ///< to poll for POLLIN; -1 where it is closed
  const std::string& path() const { return device_.path(); }
  const V4l2Layout& layout() const { return layout_; }  ///< valid while it is open
  TimeNs period_ns() const { return period_ns_; }       ///< between images, as the driver says
  std::size_t buffers() const { return buffers_.size(); }
  const V4l2Stamps& stamps() const { return stamps_; }

 private:
  struct Buffer {
    void* address = nullptr;
    std::size_t length = 0;
    bool queued = false;
    V4l2Image image;
  };

  Status start();
  Status map_buffers();
  int queue(std::uint32_t buffer);
  V4l2Take gone(const char* action, int error) const;
  V4l2Take check(const v4l2_buffer& filled);

  const Clock& clock_;
  V4l2Config config_;
  V4l2Request request_;  // its format is config_'s
  V4l2Device device_;
  V4l2Layout layout_;
  TimeNs period_ns_ = 0;
  std::vector<Buffer> buffers_;
  V4l2Stamps stamps_;
  std::uint64_t sequence_ = 0;
  bool any_ = false;
  int failed_ = 0;  // -errno of a buffer that could not be given back
  bool hung_up_ = false;
};

}  // namespace posed
