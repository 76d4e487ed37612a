#pragma once

#include <string>

#include "core/rgbd_frame.h"
#include "drivers/openni2/openni2_api.h"

/// From OpenNI2's images to a frame's. Reentrant; no allocation.
namespace posed {

/// Whether the image is whole and of `mode`: size, format, and as many bytes as they need.
bool is_of_mode(const openni::VideoFrameRef& image, const openni::VideoMode& mode);

/// Writes `bgr` and `gray` of an image for which `is_of_mode` and `is_usable_color` hold. `mirrored`: left and right change places.
void write_color(const openni::VideoFrameRef& image, bool mirrored, RgbdFrame& frame);

/// Writes `depth_m` of an image for which `is_of_mode` and `is_usable_depth` hold.
void write_depth(const openni::VideoFrameRef& image, bool mirrored, RgbdFrame& frame);

}  // namespace posed
