#pragma once

#include <filesystem>
#include <vector>

#include "core/result.h"
#include "drivers/camera_listing.h"
#include "drivers/v4l2/v4l2_system.h"

namespace posed {

/// The V4L2 nodes of this machine that deliver images. A node that cannot be opened is listed with the reason as its name. Io where
/// the folder of devices cannot be read.
Result<std::vector<ListedCamera>> list_v4l2_cameras();

/// The same of the nodes video0, video1, ... in `devices`, behind any system.
Result<std::vector<ListedCamera>> list_v4l2_cameras(V4l2System& system, const std::filesystem::path& devices);

}  // namespace posed
