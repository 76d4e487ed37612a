#pragma once

#include <vector>

#include "core/result.h"
#include "drivers/camera_listing.h"

namespace posed {

/// The cameras that libcamera finds, each with the formats that posed reads, by libcamera's names. Unavailable where libcamera
/// does not start. Thread-safe.
Result<std::vector<ListedCamera>> list_libcamera_cameras();

}  // namespace posed
