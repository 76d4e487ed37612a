#include "drivers/encoded_frame.h"

#include "drivers/image_encoder.h"

namespace posed {

Status encode_frame(const RgbdFrame& frame, const EncodingOptions& options, EncodedFrame& encoded) {
  encoded.sequence = frame.sequence;
  encoded.stamp_utc_ns = frame.stamp_utc_ns;
  encoded.depth_offset_ns = frame.depth_offset_ns;
  encoded.color_format = options.color_format;
  encoded.T_world_camera_truth = frame.T_world_camera_truth;
  const Status color = options.color_format == ColorFormat::Png ? encode_png_bgr8(frame.bgr, encoded.color)
                                                                : encode_jpeg_bgr(frame.bgr, options.jpeg_quality, encoded.color);
  return color ? encode_png_depth16(frame.depth_m, options.depth_units_per_metre, encoded.depth) : color;
}

}  // namespace posed
