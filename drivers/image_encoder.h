#pragma once

#include <cstdint>
#include <vector>

#include "core/image_view.h"
#include "core/result.h"

/// Images as the contents of image files, into `file`, whose capacity is kept from call to call. Reentrant. Error: Io, with the
/// library's reason.
namespace posed {

/// 8-bit colour PNG from three channels in the order blue, green, red.
Status encode_png_bgr8(ImageView<const std::uint8_t> bgr, std::vector<std::uint8_t>& file);

/// 8-bit grey PNG: masks.
Status encode_png_gray8(ImageView<const std::uint8_t> gray, std::vector<std::uint8_t>& file);

/// 16-bit grey PNG of round(depth_m * units_per_metre); what 16 bits cannot hold becomes 0, invalid.
Status encode_png_depth16(ImageView<const float> depth_m, double units_per_metre, std::vector<std::uint8_t>& file);

/// JPEG with unreduced colour (4:4:4), `quality` 1 to 100.
Status encode_jpeg_bgr(ImageView<const std::uint8_t> bgr, int quality, std::vector<std::uint8_t>& file);

}  // namespace posed
