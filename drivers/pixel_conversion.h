#pragma once

#include <cstdint>

#include "core/image_view.h"

/// Conversions between what files and devices deliver and what a frame holds. Both views of a call have the same size. Reentrant.
namespace posed {

/// Luma of ITU-R BT.601 in 14-bit fixed point: (4899 R + 9617 G + 1868 B + 8192) >> 14. The same on every machine.
void gray_from_bgr(ImageView<const std::uint8_t> bgr, ImageView<std::uint8_t> gray);

/// Red and blue change places: RGB to BGR and back.
void swap_red_blue(ImageView<const std::uint8_t> from, ImageView<std::uint8_t> to);

/// The grey value in all three channels.
void bgr_from_gray(ImageView<const std::uint8_t> gray, ImageView<std::uint8_t> bgr);

/// Raw 16-bit depth to metres: raw / units_per_metre, correctly rounded; 0 (invalid) stays 0.
void depth_from_raw(ImageView<const std::uint16_t> raw, double units_per_metre, ImageView<float> depth_m);

/// Metres to the nearest raw value; what 16 bits cannot hold, negative values and NaN become 0 (invalid).
void raw_from_depth(ImageView<const float> depth_m, double units_per_metre, ImageView<std::uint16_t> raw);

}  // namespace posed
