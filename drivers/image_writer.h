#pragma once

#include <cstdint>
#include <filesystem>

#include "core/image_view.h"
#include "core/result.h"

/// Writes image files. Each file appears under its name only when it is whole. Reentrant. Error: Io, which names the file (a full
/// disk included).
namespace posed {

/// 8-bit colour PNG from three channels in the order blue, green, red.
Status write_png_bgr8(const std::filesystem::path& path, ImageView<const std::uint8_t> bgr);

/// 8-bit grey PNG: masks.
Status write_png_gray8(const std::filesystem::path& path, ImageView<const std::uint8_t> gray);

/// 16-bit grey PNG of round(depth_m * units_per_metre); what 16 bits cannot hold becomes 0, invalid.
Status write_png_depth16(const std::filesystem::path& path, ImageView<const float> depth_m, double units_per_metre);

/// JPEG with unreduced colour (4:4:4), `quality` 1 to 100.
Status write_jpeg_bgr(const std::filesystem::path& path, ImageView<const std::uint8_t> bgr, int quality);

}  // namespace posed
