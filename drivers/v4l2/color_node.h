#pragma once

#include "config/camera_source_config.h"
#include "core/clock.h"
#include "core/pinhole_camera.h"
#include "core/rgbd_frame.h"
#include "drivers/mjpeg_decoder.h"
#include "drivers/v4l2/v4l2_stream.h"

namespace posed {

/// A colour camera's V4L2 node. Thread-bound.
class ColorNode {
 public:
  /// Images have the size of `color`, their calibration.
  ColorNode(V4l2System& system, const Clock& clock, const V4l2Config& config, const CameraIntrinsics& color, double rate_hz);

  Status open() { return stream_.open(); }
  void close() noexcept { stream_.close(); }

  V4l2Stream& stream() { return stream_; }
  const V4l2Stream& stream() const { return stream_; }

  /// The colour and the grey image of the frame. BadData where a JPEG is damaged.
  Status write_color(const V4l2Image& image, RgbdFrame& frame);

 private:
  V4l2Stream stream_;
  MjpegDecoder mjpeg_;
};

}  // namespace posed
