#include "drivers/image_writer.h"

#include <cassert>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <spng.h>
#include <string>
#include <turbojpeg.h>
#include <vector>

#include <fmt/format.h>

#include "core/file_io.h"
#include "drivers/pixel_conversion.h"

namespace posed {

namespace {

// The fastest of zlib's levels: recordings are written in passing, and size matters less than time.
constexpr int kCompressionLevel = 1;

struct FreePng {
  void operator()(spng_ctx* context) const noexcept { spng_ctx_free(context); }
};
struct FreeBytes {
  void operator()(void* bytes) const noexcept { std::free(bytes); }
};
struct DestroyJpeg {
  void operator()(void* handle) const noexcept { tjDestroy(handle); }
};
struct FreeJpeg {
  void operator()(unsigned char* bytes) const noexcept { tjFree(bytes); }
};

tl::unexpected<Error> encoding_failed(const std::filesystem::path& path, const char* reason) {
  return make_error(ErrorCode::Io, fmt::format("cannot encode {}: {}", path.string(), reason));
}

/// `pixels` are packed: rows follow each other without a gap, 16-bit values in this machine's byte order.
Status write_png(const std::filesystem::path& path, const void* pixels, std::size_t bytes, spng_ihdr ihdr) {
  const std::unique_ptr<spng_ctx, FreePng> context(spng_ctx_new(SPNG_CTX_ENCODER));
  if (context == nullptr) {
    return encoding_failed(path, spng_strerror(SPNG_EMEM));
  }
  int error = spng_set_option(context.get(), SPNG_ENCODE_TO_BUFFER, 1);
  error = error != 0 ? error : spng_set_option(context.get(), SPNG_IMG_COMPRESSION_LEVEL, kCompressionLevel);
  error = error != 0 ? error : spng_set_ihdr(context.get(), &ihdr);
  error = error != 0 ? error : spng_encode_image(context.get(), pixels, bytes, SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE);
  if (error != 0) {
    return encoding_failed(path, spng_strerror(error));
  }
  std::size_t size = 0;
  const std::unique_ptr<void, FreeBytes> file(spng_get_png_buffer(context.get(), &size, &error));
  if (file == nullptr) {
    return encoding_failed(path, spng_strerror(error));
  }
  return write_file(path, {static_cast<const std::uint8_t*>(file.get()), size});
}

template <typename T>
spng_ihdr header_of(ImageView<const T> image, std::uint8_t bits, std::uint8_t color_type) {
  assert(image.width > 0 && image.height > 0);
  spng_ihdr ihdr{};
  ihdr.width = static_cast<std::uint32_t>(image.width);
  ihdr.height = static_cast<std::uint32_t>(image.height);
  ihdr.bit_depth = bits;
  ihdr.color_type = color_type;
  return ihdr;
}

std::size_t pixel_count(int width, int height) {
  return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
}

}  // namespace

Status write_png_bgr8(const std::filesystem::path& path, ImageView<const std::uint8_t> bgr) {
  std::vector<std::uint8_t> rgb(3 * pixel_count(bgr.width, bgr.height));
  swap_red_blue(bgr, {rgb.data(), bgr.width, bgr.height, std::ptrdiff_t{3} * bgr.width, 3});
  return write_png(path, rgb.data(), rgb.size(), header_of(bgr, 8, SPNG_COLOR_TYPE_TRUECOLOR));
}

Status write_png_gray8(const std::filesystem::path& path, ImageView<const std::uint8_t> gray) {
  std::vector<std::uint8_t> packed;
  packed.reserve(pixel_count(gray.width, gray.height));
  for (int y = 0; y < gray.height; ++y) {
    packed.insert(packed.end(), gray.row(y), gray.row(y) + gray.width);
  }
  return write_png(path, packed.data(), packed.size(), header_of(gray, 8, SPNG_COLOR_TYPE_GRAYSCALE));
}

Status write_png_depth16(const std::filesystem::path& path, ImageView<const float> depth_m, double units_per_metre) {
  std::vector<std::uint16_t> raw(pixel_count(depth_m.width, depth_m.height));
  raw_from_depth(depth_m, units_per_metre, {raw.data(), depth_m.width, depth_m.height, depth_m.width, 1});
  return write_png(path, raw.data(), raw.size() * sizeof(std::uint16_t), header_of(depth_m, 16, SPNG_COLOR_TYPE_GRAYSCALE));
}

Status write_jpeg_bgr(const std::filesystem::path& path, ImageView<const std::uint8_t> bgr, int quality) {
  const std::unique_ptr<void, DestroyJpeg> encoder(tjInitCompress());
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const bool failed =
      encoder == nullptr || tjCompress2(encoder.get(), bgr.data, bgr.width, static_cast<int>(bgr.stride), bgr.height, TJPF_BGR,
                                        &bytes, &size, TJSAMP_444, quality, TJFLAG_ACCURATEDCT) != 0;
  const std::unique_ptr<unsigned char, FreeJpeg> file(bytes);
  if (failed) {
    return encoding_failed(path, tjGetErrorStr2(encoder.get()));
  }
  return write_file(path, {bytes, static_cast<std::size_t>(size)});
}

}  // namespace posed
