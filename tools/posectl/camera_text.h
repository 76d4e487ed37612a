#pragma once

#include <string>
#include <string_view>

#include "core/pinhole_camera.h"

namespace posed {

/// A calibration file for `camera` that `load_camera` reads back exactly. `comment` is one line or more, without '#'. Reentrant.
std::string format_camera(const CameraIntrinsics& camera, std::string_view comment);

}  // namespace posed
