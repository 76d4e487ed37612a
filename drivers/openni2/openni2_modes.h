#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "drivers/openni2/openni2_api.h"

/// Which of a device's video modes serve posed. Reentrant.
namespace posed {

struct OpenNi2Wish {
  int width = 640;
  int height = 480;
  double rate_hz = 30.0;
};

/// "rgb888", "depth_1_mm"; "format 7" for one that has no name.
std::string openni2_format_name(openni::PixelFormat format);
/// "640x480 rgb888 at 30 Hz".
std::string openni2_mode_name(const openni::VideoMode& mode);

/// Those of `offered` with the size wished and a format that can be converted, best first: colour before grey, then the nearest
/// rate, then RGB888, YUYV, YUV422; of depth the nearest rate, then 1 mm (whose range is larger) before 100 um.
std::vector<openni::VideoMode> usable_color_modes(const openni::Array<openni::VideoMode>& offered, const OpenNi2Wish& wish);
std::vector<openni::VideoMode> usable_depth_modes(const openni::Array<openni::VideoMode>& offered, const OpenNi2Wish& wish);

bool is_usable_color(openni::PixelFormat format);
bool is_usable_depth(openni::PixelFormat format);

}  // namespace posed
