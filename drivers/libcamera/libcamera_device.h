#pragma once

#include <memory>

#include "config/camera_source_config.h"
#include "core/clock.h"
#include "core/pinhole_camera.h"
#include "drivers/libcamera/color_camera.h"

namespace posed {

/// The colour camera that `config` names, through libcamera. Its images have the size of `intrinsics`. `clock` must outlive it.
std::unique_ptr<ColorCamera> make_libcamera_device(const LibcameraConfig& config, const CameraIntrinsics& intrinsics,
                                                   double rate_hz, const Clock& clock);

}  // namespace posed
