#pragma once

#include <memory>

#include "config/config.h"
#include "drivers/rgbd_source.h"

namespace posed {

/// The camera of source.libcamera with the depth node of source.depth; either may be away still. Unsupported where there is no
/// depth node: a colour camera alone cannot be tracked in metres.
Result<std::unique_ptr<RgbdSource>> make_libcamera_source(const SourceConfig& config, const CameraIntrinsics& camera,
                                                          const Clock& clock);

}  // namespace posed
