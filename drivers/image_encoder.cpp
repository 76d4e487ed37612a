#include "drivers/image_encoder.h"

#include <cassert>
#include <cstddef>
#include <memory>
#include <new>
#include <spng.h>
#include <string>
#include <turbojpeg.h>
#include <zlib.h>

#include "drivers/pixel_conversion.h"

namespace posed {

namespace {

// The fastest of zlib's levels: recordings are written in passing, and size matters less than time.
constexpr int kCompressionLevel = 1;

/// How a PNG is compressed. What is chosen here takes a third of the time of the library's defaults, measured on the TUM
/// recordings, and no more room.
struct Compression {
  int filter;
  int strategy;
};
constexpr Compression kForColor{SPNG_FILTER_CHOICE_UP, Z_RLE};
constexpr Compression kForGray{SPNG_FILTER_CHOICE_NONE, Z_DEFAULT_STRATEGY};

struct FreePng {
  void operator()(spng_ctx* context) const noexcept { spng_ctx_free(context); }
};
struct DestroyJpeg {
  void operator()(void* handle) const noexcept { tjDestroy(handle); }
};
struct FreeJpeg {
  void operator()(unsigned char* bytes) const noexcept { tjFree(bytes); }
};

tl::unexpected<Error> encoding_failed(const char* reason) {
  return make_error(ErrorCode::Io, std::string("cannot encode the image: ") + reason);
}

int append_to_file(spng_ctx* /*context*/, void* file, void* bytes, std::size_t size) noexcept {
  try {
    const auto* begin = static_cast<const std::uint8_t*>(bytes);
    auto& target = *static_cast<std::vector<std::uint8_t>*>(file);
    target.insert(target.end(), begin, begin + size);
    return 0;
  } catch (const std::bad_alloc&) {
    return SPNG_EMEM;  // no exception may pass the library
  }
}

/// `pixels` are packed: rows follow each other without a gap, 16-bit values in this machine's byte order.
Status encode_png(const void* pixels, std::size_t bytes, spng_ihdr ihdr, Compression compression, std::vector<std::uint8_t>& file) {
  file.clear();
  const std::unique_ptr<spng_ctx, FreePng> context(spng_ctx_new(SPNG_CTX_ENCODER));
  if (context == nullptr) {
    return encoding_failed(spng_strerror(SPNG_EMEM));
  }
  int error = spng_set_png_stream(context.get(), append_to_file, &file);
  error = error != 0 ? error : spng_set_option(context.get(), SPNG_IMG_COMPRESSION_LEVEL, kCompressionLevel);
  error = error != 0 ? error : spng_set_option(context.get(), SPNG_IMG_COMPRESSION_STRATEGY, compression.strategy);
  error = error != 0 ? error : spng_set_option(context.get(), SPNG_FILTER_CHOICE, compression.filter);
  error = error != 0 ? error : spng_set_ihdr(context.get(), &ihdr);
  error = error != 0 ? error : spng_encode_image(context.get(), pixels, bytes, SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE);
  return error != 0 ? Status(encoding_failed(spng_strerror(error))) : Status();
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

Status encode_png_bgr8(ImageView<const std::uint8_t> bgr, std::vector<std::uint8_t>& file) {
  std::vector<std::uint8_t> rgb(3 * pixel_count(bgr.width, bgr.height));
  swap_red_blue(bgr, {rgb.data(), bgr.width, bgr.height, std::ptrdiff_t{3} * bgr.width, 3});
  return encode_png(rgb.data(), rgb.size(), header_of(bgr, 8, SPNG_COLOR_TYPE_TRUECOLOR), kForColor, file);
}

Status encode_png_gray8(ImageView<const std::uint8_t> gray, std::vector<std::uint8_t>& file) {
  std::vector<std::uint8_t> packed;
  packed.reserve(pixel_count(gray.width, gray.height));
  for (int y = 0; y < gray.height; ++y) {
    packed.insert(packed.end(), gray.row(y), gray.row(y) + gray.width);
  }
  return encode_png(packed.data(), packed.size(), header_of(gray, 8, SPNG_COLOR_TYPE_GRAYSCALE), kForGray, file);
}

Status encode_png_depth16(ImageView<const float> depth_m, double units_per_metre, std::vector<std::uint8_t>& file) {
  std::vector<std::uint16_t> raw(pixel_count(depth_m.width, depth_m.height));
  raw_from_depth(depth_m, units_per_metre, {raw.data(), depth_m.width, depth_m.height, depth_m.width, 1});
  return encode_png(raw.data(), raw.size() * sizeof(std::uint16_t), header_of(depth_m, 16, SPNG_COLOR_TYPE_GRAYSCALE), kForGray,
                    file);
}

Status encode_jpeg_bgr(ImageView<const std::uint8_t> bgr, int quality, std::vector<std::uint8_t>& file) {
  const std::unique_ptr<void, DestroyJpeg> encoder(tjInitCompress());
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const bool failed =
      encoder == nullptr || tjCompress2(encoder.get(), bgr.data, bgr.width, static_cast<int>(bgr.stride), bgr.height, TJPF_BGR,
                                        &bytes, &size, TJSAMP_444, quality, TJFLAG_ACCURATEDCT) != 0;
  const std::unique_ptr<unsigned char, FreeJpeg> encoded(bytes);
  if (failed) {
    return encoding_failed(tjGetErrorStr2(encoder.get()));
  }
  file.assign(bytes, bytes + size);
  return {};
}

}  // namespace posed
