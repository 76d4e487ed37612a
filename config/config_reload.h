#pragma once

#include <string>
#include <vector>

#include "config/config.h"

namespace posed {

/// What a configuration that was read again changes in a running daemon.
struct ReloadOutcome {
  std::vector<std::string> taken;    ///< keys whose new values hold now
  std::vector<std::string> refused;  ///< keys whose new values need a restart
};

/// Takes the values of keys that are `live` (docs/configuration.md) from `fresh` over into `running`, and leaves all others as they
/// are. A calibration whose content differs counts as `camera.calibration`. Reentrant.
ReloadOutcome take_live_values(const Config& fresh, Config& running);

}  // namespace posed
