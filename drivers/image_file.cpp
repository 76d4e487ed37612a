#include "drivers/image_file.h"

#include <algorithm>
#include <array>
#include <spng.h>
#include <turbojpeg.h>

#include <fmt/format.h>

#include "core/file_io.h"
#include "drivers/pixel_conversion.h"

namespace posed {

namespace {

constexpr std::array<std::uint8_t, 8> kPngSignature{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
constexpr std::array<std::uint8_t, 3> kJpegSignature{0xff, 0xd8, 0xff};

// Text, colour profiles and the like: nothing here reads them, so their memory is bounded.
constexpr std::size_t kMaxPngChunkBytes = std::size_t{1} << 20;
constexpr std::size_t kMaxPngChunkCacheBytes = std::size_t{4} << 20;

tl::unexpected<Error> bad_image(std::string message) {
  return make_error(ErrorCode::BadData, std::move(message));
}

template <std::size_t N>
bool starts_with(std::span<const std::uint8_t> file, const std::array<std::uint8_t, N>& signature) {
  return file.size() >= N && std::equal(signature.begin(), signature.end(), file.begin());
}

Status check_size(const ImageHeader& header, int width, int height) {
  if (header.width != width || header.height != height) {
    return bad_image(fmt::format("the image is {}x{} where {}x{} is expected", header.width, header.height, width, height));
  }
  return {};
}

/// One PNG in memory; libspng's contexts serve a single image each.
class PngReader {
 public:
  explicit PngReader(std::span<const std::uint8_t> file) : context_(spng_ctx_new(0)) {
    if (context_ == nullptr) {
      error_ = SPNG_EMEM;
      return;
    }
    error_ = spng_set_chunk_limits(context_.get(), kMaxPngChunkBytes, kMaxPngChunkCacheBytes);
    if (error_ == 0) {
      error_ = spng_set_png_buffer(context_.get(), file.data(), file.size());
    }
  }

  Result<ImageHeader> header() {
    spng_ihdr ihdr{};
    if (error_ == 0) {
      error_ = spng_get_ihdr(context_.get(), &ihdr);
    }
    if (error_ != 0) {
      return failure();
    }
    ImageHeader header{"PNG", static_cast<int>(ihdr.width), static_cast<int>(ihdr.height), ihdr.bit_depth, 1, "grey"};
    switch (ihdr.color_type) {
      case SPNG_COLOR_TYPE_TRUECOLOR: header.channels = 3, header.layout = "colour"; break;
      case SPNG_COLOR_TYPE_INDEXED: header.layout = "palette"; break;
      case SPNG_COLOR_TYPE_GRAYSCALE_ALPHA: header.channels = 2, header.layout = "grey with alpha"; break;
      case SPNG_COLOR_TYPE_TRUECOLOR_ALPHA: header.channels = 4, header.layout = "colour with alpha"; break;
      default: break;
    }
    return header;
  }

  /// All pixels, in the file's own channels and this machine's byte order.
  Status pixels(void* out, std::size_t bytes) {
    error_ = spng_decode_image(context_.get(), out, bytes, SPNG_FMT_PNG, 0);
    if (error_ == 0) {
      error_ = spng_decode_chunks(context_.get());  // the checksum of the last pixels and the end of the file
    }
    return error_ == 0 ? Status{} : failure();
  }

 private:
  tl::unexpected<Error> failure() const { return bad_image(fmt::format("truncated or corrupt PNG ({})", spng_strerror(error_))); }

  struct Free {
    void operator()(spng_ctx* context) const noexcept { spng_ctx_free(context); }
  };
  std::unique_ptr<spng_ctx, Free> context_;
  int error_ = 0;
};

Status with_path(Status status, const std::filesystem::path& path) {
  if (!status) {
    status.error().message = fmt::format("{}: {}", path.string(), status.error().message);
  }
  return status;
}

}  // namespace

void ImageDecoder::DestroyJpeg::operator()(void* handle) const noexcept {
  tjDestroy(handle);
}

ImageDecoder::ImageDecoder() : jpeg_(tjInitDecompress()) {}
ImageDecoder::~ImageDecoder() = default;

Status ImageDecoder::read_color(const std::filesystem::path& path, ImageView<std::uint8_t> bgr, ImageView<std::uint8_t> gray) {
  if (Status read = read_file(path, file_); !read) {
    return read;
  }
  return with_path(decode_color(file_, bgr, gray), path);
}

Status ImageDecoder::read_depth(const std::filesystem::path& path, double units_per_metre, ImageView<float> depth_m) {
  if (Status read = read_file(path, file_); !read) {
    return read;
  }
  return with_path(decode_depth(file_, units_per_metre, depth_m), path);
}

Result<ImageHeader> ImageDecoder::read_header(const std::filesystem::path& path) {
  if (Status read = read_file(path, file_); !read) {
    return tl::unexpected(std::move(read.error()));
  }
  Result<ImageHeader> header = decode_header(file_);
  if (!header) {
    header.error().message = fmt::format("{}: {}", path.string(), header.error().message);
  }
  return header;
}

Result<ImageHeader> ImageDecoder::decode_header(std::span<const std::uint8_t> file) {
  if (starts_with(file, kPngSignature)) {
    return PngReader(file).header();
  }
  if (starts_with(file, kJpegSignature)) {
    return jpeg_header(file);
  }
  return bad_image(file.empty() ? "the file is empty" : "neither PNG nor JPEG");
}

Status ImageDecoder::decode_color(std::span<const std::uint8_t> file, ImageView<std::uint8_t> bgr, ImageView<std::uint8_t> gray) {
  if (starts_with(file, kPngSignature)) {
    return decode_color_png(file, bgr, gray);
  }
  if (starts_with(file, kJpegSignature)) {
    return decode_color_jpeg(file, bgr, gray);
  }
  return bad_image(file.empty() ? "the file is empty" : "neither PNG nor JPEG");
}

Status ImageDecoder::decode_color_png(std::span<const std::uint8_t> file, ImageView<std::uint8_t> bgr,
                                      ImageView<std::uint8_t> gray) {
  PngReader png(file);
  const Result<ImageHeader> header = png.header();
  if (!header) {
    return tl::unexpected(header.error());
  }
  if (Status size = check_size(*header, bgr.width, bgr.height); !size) {
    return size;
  }
  const bool is_gray = header->layout == "grey";
  if (header->bits != 8 || !(is_gray || header->layout == "colour")) {
    return bad_image(fmt::format("a PNG of {} bits, {}, where 8 bits, colour or grey, is expected", header->bits, header->layout));
  }
  const std::ptrdiff_t stride = static_cast<std::ptrdiff_t>(bgr.width) * header->channels;
  color_.resize(static_cast<std::size_t>(stride) * static_cast<std::size_t>(bgr.height));
  if (Status pixels = png.pixels(color_.data(), color_.size()); !pixels) {
    return pixels;
  }
  const ImageView<const std::uint8_t> decoded{color_.data(), bgr.width, bgr.height, stride, header->channels};
  if (is_gray) {
    bgr_from_gray(decoded, bgr);
  } else {
    swap_red_blue(decoded, bgr);
  }
  gray_from_bgr(bgr, gray);  // leaves grey values as they are: the weights sum to one
  return {};
}

tl::unexpected<Error> ImageDecoder::jpeg_failure() {
  const auto failure = bad_image(fmt::format("truncated or corrupt JPEG ({})", tjGetErrorStr2(jpeg_.get())));
  // A decompressor that gave up within a header goes on reading there, so the next file needs a new one.
  jpeg_.reset(tjInitDecompress());
  return failure;
}

Result<ImageHeader> ImageDecoder::jpeg_header(std::span<const std::uint8_t> file) {
  int width = 0;
  int height = 0;
  int subsampling = 0;
  int color_space = 0;
  if (jpeg_ == nullptr || tjDecompressHeader3(jpeg_.get(), file.data(), static_cast<unsigned long>(file.size()), &width, &height,
                                              &subsampling, &color_space) != 0) {
    return jpeg_failure();
  }
  ImageHeader header{"JPEG", width, height, 8, 3, "colour"};
  if (color_space == TJCS_GRAY) {
    header.channels = 1, header.layout = "grey";
  } else if (color_space == TJCS_CMYK || color_space == TJCS_YCCK) {
    header.channels = 4, header.layout = "CMYK";
  }
  return header;
}

Status ImageDecoder::decode_color_jpeg(std::span<const std::uint8_t> file, ImageView<std::uint8_t> bgr,
                                       ImageView<std::uint8_t> gray) {
  const Result<ImageHeader> header = jpeg_header(file);
  if (!header) {
    return tl::unexpected(header.error());
  }
  if (Status size = check_size(*header, bgr.width, bgr.height); !size) {
    return size;
  }
  if (header->layout == "CMYK") {
    return bad_image("a JPEG of four inks (CMYK) where colour or grey is expected");
  }
  // Without STOPONWARNING the library fills what is missing with grey; without LIMITSCANS a small file can cost minutes.
  constexpr int kFlags = TJFLAG_STOPONWARNING | TJFLAG_LIMITSCANS;
  if (tjDecompress2(jpeg_.get(), file.data(), static_cast<unsigned long>(file.size()), bgr.data, bgr.width,
                    static_cast<int>(bgr.stride), bgr.height, TJPF_BGR, kFlags) != 0) {
    return jpeg_failure();
  }
  gray_from_bgr(bgr, gray);
  return {};
}

Status ImageDecoder::decode_depth(std::span<const std::uint8_t> file, double units_per_metre, ImageView<float> depth_m) {
  if (!starts_with(file, kPngSignature)) {
    return bad_image(file.empty() ? "the file is empty" : "not a PNG; depth is expected as PNG of 16 bits, grey");
  }
  PngReader png(file);
  const Result<ImageHeader> header = png.header();
  if (!header) {
    return tl::unexpected(header.error());
  }
  if (Status size = check_size(*header, depth_m.width, depth_m.height); !size) {
    return size;
  }
  if (header->bits != 16 || header->layout != "grey") {
    return bad_image(fmt::format("a PNG of {} bits, {}, where depth of 16 bits, grey, is expected", header->bits, header->layout));
  }
  depth_.resize(static_cast<std::size_t>(depth_m.width) * static_cast<std::size_t>(depth_m.height));
  if (Status pixels = png.pixels(depth_.data(), depth_.size() * sizeof(std::uint16_t)); !pixels) {
    return pixels;
  }
  depth_from_raw({depth_.data(), depth_m.width, depth_m.height, depth_m.width, 1}, units_per_metre, depth_m);
  return {};
}

}  // namespace posed
