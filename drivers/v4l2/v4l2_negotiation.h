#pragma once

#include <span>
#include <string_view>

#include "core/clock.h"
#include "core/result.h"
#include "drivers/v4l2/v4l2_device.h"
#include "drivers/v4l2/v4l2_format.h"

/// What a node is asked for, and what it says that it will do. Reentrant.
namespace posed {

struct V4l2Request {
  std::span<const V4l2PixelFormat> formats;  ///< that can be used, best first
  std::string_view format = "auto";          ///< the configuration's word: one of them, or "auto"
  int width = 640;
  int height = 480;
  double rate_hz = 30;
};

/// Unsupported: the node delivers no images, or only by ways that we do not use.
Status check_capture_node(const V4l2Device& device);

/// Sets the format and checks what the driver made of it, which may be anything: Unsupported names what was asked, what came, and
/// what the node offers.
Result<V4l2Layout> negotiate_format(const V4l2Device& device, const V4l2Request& request);

/// Asks for the rate and returns the time between frames that the driver took; that of `rate_hz` where it does not tell.
TimeNs negotiate_period(const V4l2Device& device, double rate_hz);

}  // namespace posed
