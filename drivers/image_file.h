#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/image_view.h"
#include "core/result.h"

namespace posed {

/// What an image file says of itself.
struct ImageHeader {
  std::string format;  ///< "PNG" or "JPEG"
  int width = 0;       ///< pixels
  int height = 0;      ///< pixels
  int bits = 0;        ///< a channel
  int channels = 0;
  std::string layout;  ///< "grey", "colour", "grey with alpha", "palette", ...: for messages
};

/// Decodes the images of a recording straight into a frame's views: 8-bit PNG or JPEG colour (grey ones are replicated) and 16-bit
/// PNG depth. Strict, because a half-decoded image looks like a scene: data that ends early, a wrong checksum, a size that is not
/// the views', a wrong bit depth or number of channels are errors, and the views' pixels are then unspecified. JPEG carries no
/// checksum, so flipped bits that still decode pass unseen. Headers are judged before anything is allocated, so a hostile file
/// costs at most its own size and one image. Pixel buffers are kept from call to call; the libraries allocate their row buffers and
/// inflate state a frame (progressive JPEG: the whole image's coefficients). Of a PNG, only the checksum of the end chunk, after
/// the last pixel, is not asked for.
///
/// Reentrant: one decoder serves one thread at a time. Messages name what was found and what was expected; those of the `read_`
/// functions begin with the path. Errors: BadData; from the `read_` functions also NotFound and Io.
class ImageDecoder {
 public:
  ImageDecoder();
  ~ImageDecoder();
  ImageDecoder(const ImageDecoder&) = delete;
  ImageDecoder& operator=(const ImageDecoder&) = delete;

  Status read_color(const std::filesystem::path& path, ImageView<std::uint8_t> bgr, ImageView<std::uint8_t> gray);
  Status read_depth(const std::filesystem::path& path, double units_per_metre, ImageView<float> depth_m);
  Result<ImageHeader> read_header(const std::filesystem::path& path);

  Status decode_color(std::span<const std::uint8_t> file, ImageView<std::uint8_t> bgr, ImageView<std::uint8_t> gray);
  Status decode_depth(std::span<const std::uint8_t> file, double units_per_metre, ImageView<float> depth_m);
  Result<ImageHeader> decode_header(std::span<const std::uint8_t> file);

 private:
  Status decode_color_png(std::span<const std::uint8_t> file, ImageView<std::uint8_t> bgr, ImageView<std::uint8_t> gray);
  Status decode_color_jpeg(std::span<const std::uint8_t> file, ImageView<std::uint8_t> bgr, ImageView<std::uint8_t> gray);
  Result<ImageHeader> jpeg_header(std::span<const std::uint8_t> file);
  tl::unexpected<Error> jpeg_failure();

  struct DestroyJpeg {
    void operator()(void* handle) const noexcept;
  };
  std::unique_ptr<void, DestroyJpeg> jpeg_;  // turbojpeg's decompressor
  std::vector<std::uint8_t> file_;
  std::vector<std::uint8_t> color_;  // a PNG's pixels before they become BGR
  std::vector<std::uint16_t> depth_;
};

}  // namespace posed
