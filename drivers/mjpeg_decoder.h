#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "core/image_view.h"
#include "core/result.h"

namespace posed {

/// Decodes the JPEG images of a camera's MJPEG stream, one after the other, by libjpeg-turbo. Thread-bound. Allocates nothing of
/// its own; libjpeg-turbo does for each image.
class MjpegDecoder {
 public:
  MjpegDecoder();
  ~MjpegDecoder();

  /// The image in colour and grey. BadData: it is cut short or damaged, or has another size than the views. Cameras often leave a
  /// few bytes too many behind an image, and the usual tables out of it: that is no damage.
  Status decode(std::span<const std::uint8_t> jpeg, ImageView<std::uint8_t> bgr, ImageView<std::uint8_t> gray);

 private:
  struct Destroy {
    void operator()(void* handle) const noexcept;
  };
  tl::unexpected<Error> failure();

  std::unique_ptr<void, Destroy> decompressor_;
};

}  // namespace posed
