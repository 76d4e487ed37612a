#pragma once

#include <memory>

#include "config/config.h"
#include "drivers/rgbd_source.h"

namespace posed {

/// The camera of source.v4l2 and source.depth, which may be away still. Unsupported where there is no depth node: a colour camera
/// alone cannot be tracked in metres. InvalidArgument: the colour node has no path.
Result<std::unique_ptr<RgbdSource>> make_v4l2_source(const SourceConfig& config, const CameraIntrinsics& camera,
                                                     const Clock& clock);

}  // namespace posed
