#pragma once

#include <string>
#include <vector>

namespace posed {

/// One image format that a camera offers.
struct ListedFormat {
  std::string stream;  ///< "color", "depth" or "infrared"
  std::string format;  ///< the configuration's word for it ("yuyv", "z16"), or the driver's where it has none
  int width = 0;
  int height = 0;
  double rate_hz = 0;  ///< the highest; 0 where the driver does not tell
};

/// One camera as `posectl devices` shows it, by one of the drivers. A driver lists by `Result<std::vector<ListedCamera>>
/// list_...()`, which finds nothing on a machine without such cameras, and fails only where it could not look. Plain data.
struct ListedCamera {
  std::string kind;  ///< source.kind that opens it
  std::string id;    ///< what the configuration names it by: a path, a URI, an id
  std::string name;  ///< for people
  std::vector<ListedFormat> formats;
};

}  // namespace posed
