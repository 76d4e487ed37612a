#include "drivers/mjpeg_decoder.h"

#include <cstdio>
#include <turbojpeg.h>

#include <fmt/format.h>

#include "drivers/pixel_conversion.h"

namespace posed {

namespace {

constexpr unsigned kMostPadding = 16;  // bytes before a marker that cameras pad with; a lost packet leaves more, or too few

/// Whether libjpeg-turbo only found padding. It tells its warnings apart by their words alone.
bool is_padding(const char* warning) {
  unsigned bytes = 0;
  return std::sscanf(warning, "Corrupt JPEG data: %u extraneous bytes before marker", &bytes) == 1 && bytes <= kMostPadding;
}

}  // namespace

void MjpegDecoder::Destroy::operator()(void* handle) const noexcept {
  tjDestroy(handle);
}

MjpegDecoder::MjpegDecoder() : decompressor_(tjInitDecompress()) {}
MjpegDecoder::~MjpegDecoder() = default;

tl::unexpected<Error> MjpegDecoder::failure() {
  const auto failure = make_error(ErrorCode::BadData, fmt::format("damaged JPEG ({})", tjGetErrorStr2(decompressor_.get())));
  // A decompressor that gave up within an image goes on reading there, so the next image needs a new one.
  decompressor_.reset(tjInitDecompress());
  return failure;
}

Status MjpegDecoder::decode(std::span<const std::uint8_t> jpeg, ImageView<std::uint8_t> bgr, ImageView<std::uint8_t> gray) {
  int width = 0;
  int height = 0;
  int subsampling = 0;
  int color_space = 0;
  const auto size = static_cast<unsigned long>(jpeg.size());
  tjhandle handle = decompressor_.get();
  if (tjDecompressHeader3(handle, jpeg.data(), size, &width, &height, &subsampling, &color_space) != 0) {
    return failure();
  }
  if (width != bgr.width || height != bgr.height) {
    return make_error(ErrorCode::BadData,
                      fmt::format("the JPEG has {}x{} pixels where {}x{} are expected", width, height, bgr.width, bgr.height));
  }
  // Without LIMITSCANS a small image can cost minutes.
  if (tjDecompress2(handle, jpeg.data(), size, bgr.data, width, static_cast<int>(bgr.stride), height, TJPF_BGR,
                    TJFLAG_LIMITSCANS) != 0 &&
      !(tjGetErrorCode(handle) == TJERR_WARNING && is_padding(tjGetErrorStr2(handle)))) {
    return failure();
  }
  gray_from_bgr(bgr, gray);
  return {};
}

}  // namespace posed
