#pragma once

#include <memory>
#include <vector>

#include "config/config.h"
#include "core/clock.h"
#include "core/result.h"
#include "drivers/camera_listing.h"
#include "drivers/rgbd_source.h"

namespace posed {

/// An RGB-D camera by OpenNI2, or a recording of one (docs/cameras-openni2.md). A camera need not be there yet. Errors: NotFound
/// (the recording), InvalidArgument. `clock` must outlive it.
Result<std::unique_ptr<RgbdSource>> make_openni2_source(const SourceConfig& config, const CameraIntrinsics& camera,
                                                        const Clock& clock);

/// The cameras that OpenNI2's drivers find. One that another program uses is listed without formats. Error: Unavailable.
Result<std::vector<ListedCamera>> list_openni2_cameras();

}  // namespace posed
