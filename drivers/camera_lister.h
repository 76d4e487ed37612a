#pragma once

#include <string>
#include <vector>

#include "core/result.h"
#include "drivers/camera_listing.h"

namespace posed {

/// What one driver found.
struct DriverListing {
  std::string kind;    ///< source.kind
  bool built = false;  ///< this build has the driver
  std::vector<ListedCamera> cameras;
  Status status;  ///< why it could not look
};

/// The cameras of this machine, by every driver. May take seconds and opens devices for a moment. Thread-bound.
std::vector<DriverListing> list_cameras();

}  // namespace posed
