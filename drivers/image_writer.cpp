#include "drivers/image_writer.h"

#include <vector>

#include <fmt/format.h>

#include "core/file_io.h"
#include "drivers/image_encoder.h"

namespace posed {

namespace {

/// `encode` fills the vector that it is given.
template <typename Encode>
Status write_encoded(const std::filesystem::path& path, Encode&& encode) {
  std::vector<std::uint8_t> file;
  if (const Status encoded = encode(file); !encoded) {
    return make_error(encoded.error().code, fmt::format("{}: {}", path.string(), encoded.error().message));
  }
  return write_file(path, file);
}

}  // namespace

Status write_png_bgr8(const std::filesystem::path& path, ImageView<const std::uint8_t> bgr) {
  return write_encoded(path, [&](std::vector<std::uint8_t>& file) { return encode_png_bgr8(bgr, file); });
}

Status write_png_gray8(const std::filesystem::path& path, ImageView<const std::uint8_t> gray) {
  return write_encoded(path, [&](std::vector<std::uint8_t>& file) { return encode_png_gray8(gray, file); });
}

Status write_png_depth16(const std::filesystem::path& path, ImageView<const float> depth_m, double units_per_metre) {
  return write_encoded(path, [&](std::vector<std::uint8_t>& file) { return encode_png_depth16(depth_m, units_per_metre, file); });
}

Status write_jpeg_bgr(const std::filesystem::path& path, ImageView<const std::uint8_t> bgr, int quality) {
  return write_encoded(path, [&](std::vector<std::uint8_t>& file) { return encode_jpeg_bgr(bgr, quality, file); });
}

}  // namespace posed
