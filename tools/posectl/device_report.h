#pragma once

#include <string>
#include <vector>

#include "core/result.h"
#include "drivers/camera_lister.h"

/// What `posectl devices` prints, made of what the drivers found. Reentrant.
namespace posed {

struct FoundDevices {
  std::vector<DriverListing> cameras;
  bool gpio_built = false;        ///< this build has GPIO
  std::vector<std::string> gpio;  ///< a line of text each: a chip or a line of one
};

/// A table for people.
std::string format_devices(const FoundDevices& devices);

/// The same as one JSON object.
std::string devices_json(const FoundDevices& devices);

/// A configuration to start from, as `load_config` reads it, for the best RGB-D camera there is: OpenNI2's first, else a colour
/// camera by V4L2 or libcamera with a depth node of V4L2, one of the same device where there is one. Error NotFound: there is none.
Result<std::string> suggest_config(const std::vector<DriverListing>& cameras);

}  // namespace posed
