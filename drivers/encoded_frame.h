#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/result.h"
#include "core/rgbd_frame.h"
#include "core/se3.h"

namespace posed {

enum class ColorFormat { Png, Jpeg };

struct EncodingOptions {
  double depth_units_per_metre = 5000.0;
  ColorFormat color_format = ColorFormat::Png;
  int jpeg_quality = 95;
};

/// A frame as the image files of a recording. Made anew of frame after frame, it keeps its buffers.
struct EncodedFrame {
  std::uint64_t sequence = 0;
  std::int64_t stamp_utc_ns = 0;
  TimeNs depth_offset_ns = 0;  ///< as in RgbdFrame
  ColorFormat color_format = ColorFormat::Png;
  std::vector<std::uint8_t> color;  ///< a PNG or JPEG file
  std::vector<std::uint8_t> depth;  ///< a 16-bit PNG file
  std::optional<Se3> T_world_camera_truth;
};

/// Errors: as the encoders of image_encoder.h. Reentrant.
Status encode_frame(const RgbdFrame& frame, const EncodingOptions& options, EncodedFrame& encoded);

}  // namespace posed
