#include "drivers/libcamera/libcamera_manager.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>

#include <libcamera/formats.h>

namespace posed {

namespace {

constexpr std::array<ReadableFormat, 5> kReadable{{{libcamera::formats::RGB888, ColorLayout::Bgr},
                                                   {libcamera::formats::BGR888, ColorLayout::Rgb},
                                                   {libcamera::formats::YUYV, ColorLayout::Yuyv},
                                                   {libcamera::formats::NV12, ColorLayout::Nv12},
                                                   {libcamera::formats::MJPEG, ColorLayout::Mjpeg}}};

struct RunningManager {
  libcamera::CameraManager manager;
  int status = manager.start();
};

}  // namespace

Result<libcamera::CameraManager*> camera_manager() {
  static RunningManager running;  // its destructor stops it
  if (running.status != 0) {
    auto error = libcamera_error("libcamera does not start", running.status);
    error.value().code = ErrorCode::Unavailable;
    return error;
  }
  return &running.manager;
}

std::span<const ReadableFormat> readable_formats() {
  return kReadable;
}

const ReadableFormat* find_readable(const libcamera::PixelFormat& format) {
  const auto found =
      std::find_if(kReadable.begin(), kReadable.end(), [&](const ReadableFormat& candidate) { return candidate.format == format; });
  return found == kReadable.end() ? nullptr : &*found;
}

tl::unexpected<Error> libcamera_error(const std::string& what, int error) {
  const bool is_away = error == -ENODEV || error == -ENOENT || error == -ENXIO;
  const ErrorCode code = error == -EBUSY ? ErrorCode::Unavailable : is_away ? ErrorCode::NotFound : ErrorCode::Io;
  return make_error(code, what + ": " + std::generic_category().message(-error));
}

}  // namespace posed
