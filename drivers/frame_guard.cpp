#include "drivers/frame_guard.h"

#include <algorithm>
#include <cstring>

#include <fmt/format.h>

namespace posed {

namespace {

template <typename T>
bool same_pixels(const ImageView<T>& a, const ImageView<T>& b) {
  const std::size_t row_bytes = static_cast<std::size_t>(a.width) * static_cast<std::size_t>(a.channels) * sizeof(T);
  for (int y = 0; y < a.height; ++y) {
    if (std::memcmp(a.row(y), b.row(y), row_bytes) != 0) {
      return false;
    }
  }
  return true;
}

/// Ends at the first difference, so it costs nothing but for an image that is repeated.
bool same_images(const RgbdFrame& a, const RgbdFrame& b) {
  return same_pixels(a.gray, b.gray) && same_pixels(a.depth_m, b.depth_m);
}

bool has_depth(const RgbdFrame& frame) {
  for (int y = 0; y < frame.depth_m.height; ++y) {
    const float* const row = frame.depth_m.row(y);
    if (std::any_of(row, row + frame.depth_m.width, [](float metres) { return metres > 0; })) {
      return true;
    }
  }
  return false;
}

}  // namespace

std::optional<std::string> FrameGuard::judge(const RgbdFrame& frame, TimeNs now_ns) {
  if (frame.capture_ns > now_ns + kFuture_ns) {
    return fmt::format("a frame's stamp is {:.3f} s in the future", to_seconds(frame.capture_ns - now_ns));
  }
  if (last_capture_ns_ && frame.capture_ns <= *last_capture_ns_) {
    return fmt::format("a frame's stamp is {:.6f} s before that of the frame before it",
                       to_seconds(*last_capture_ns_ - frame.capture_ns));
  }
  last_capture_ns_ = frame.capture_ns;
  repeats_ = last_ && same_images(frame, *last_) && has_depth(frame) ? repeats_ + 1 : 0;
  if (repeats_ > kRepeatsAllowed) {
    return fmt::format("the camera repeats one image, {} times so far", repeats_);
  }
  return std::nullopt;
}

}  // namespace posed
