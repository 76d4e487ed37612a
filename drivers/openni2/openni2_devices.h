#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "drivers/openni2/openni2_api.h"
#include "drivers/openni2/openni2_runtime.h"

/// Finding devices. All of it needs an OpenNi2Runtime that is held. Reentrant.
namespace posed {

inline constexpr std::string_view kOpenNi2Serial = "serial:";  ///< before a number that names a device

/// A path that ends in .oni; such a one is never a camera's URI.
bool is_openni2_recording(std::string_view device);

struct OpenNi2Found {
  std::string uri;
  std::string vendor;
  std::string name;
};

/// The cameras that are there, without recordings.
std::vector<OpenNi2Found> find_openni2_devices();

/// "" where it tells none.
std::string openni2_serial(openni::Device& device);

/// Opens what OpenNi2Config::device names, watched from before it is opened. Errors: NotFound, Unavailable (another program may
/// have it), BadData (a recording that cannot be read).
Result<std::unique_ptr<OpenNi2Watch>> open_openni2_device(const std::string& wanted, openni::Device& device);

}  // namespace posed
