#pragma once

#include <cstdint>
#include <optional>

#include "config/camera_source_config.h"
#include "core/clock.h"
#include "core/image_view.h"
#include "drivers/depth_registration.h"
#include "drivers/v4l2/v4l2_stream.h"

namespace posed {

/// The depth camera beside a colour camera: a V4L2 node whose images become metres in the colour image. For a colour camera of any
/// driver, which pairs by stamps (drivers/frame_pairer.h):
///
///     poll node.stream().descriptor() for POLLIN, with the colour camera's own      (or node.stream().wait())
///     node.stream().note_poll(revents);
///     V4l2Take took = node.stream().take();          // Frame, Nothing, BadFrame, Gone, as Camera::read has them
///     node.write_depth(took.image, frame.depth_m);   // when its pair is known
///     node.stream().give_back(took.image.buffer);    // always, and soon: the driver has few buffers
///
/// Thread-bound.
class DepthNode {
 public:
  /// `color`: the calibration of the colour camera, whose size frames have. Where `config.calibration` is empty, the node's images
  /// have that size, too, are registered, and have `color.depth_units_per_metre`.
  DepthNode(V4l2System& system, const Clock& clock, const DepthNodeConfig& config, const CameraIntrinsics& color, double rate_hz);

  Status open() { return stream_.open(); }
  void close() noexcept { stream_.close(); }

  V4l2Stream& stream() { return stream_; }
  const V4l2Stream& stream() const { return stream_; }

  /// Metres, registered to colour. `depth_m` has the colour image's size. Does not allocate.
  void write_depth(const V4l2Image& image, ImageView<float> depth_m) const;

 private:
  V4l2Stream stream_;
  double units_per_metre_;
  std::optional<DepthRegistration> registration_;  // where the depth camera has a calibration of its own
};

}  // namespace posed
