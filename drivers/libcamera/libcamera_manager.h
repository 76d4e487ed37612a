#pragma once

#include <string>

#include <libcamera/camera_manager.h>
#include <libcamera/pixel_format.h>

#include "core/result.h"
#include "drivers/libcamera/color_image.h"

/// What the files that speak to libcamera share; no other includes this.
namespace posed {

/// The process's one manager, running. libcamera 0.0.3 allows a second one neither beside the first nor, with certainty, after it,
/// so it is started at the first use and stopped when the process ends; it notices cameras that come and go meanwhile.
/// Unavailable, from then on, where it does not start. Thread-safe.
Result<libcamera::CameraManager*> camera_manager();

/// A format that posed reads; null where it does not.
struct ReadableFormat {
  libcamera::PixelFormat format;
  ColorLayout layout;
};
const ReadableFormat* find_readable(const libcamera::PixelFormat& format);

/// In the order in which they are tried.
std::span<const ReadableFormat> readable_formats();

/// An error of libcamera (-errno) in words: "WHAT: REASON".
tl::unexpected<Error> libcamera_error(const std::string& what, int error);

}  // namespace posed
