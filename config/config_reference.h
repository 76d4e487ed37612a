#pragma once

#include <string>

#include "config/config.h"

/// Texts that are made from the schema, so that they cannot say anything else than the loader does. Reentrant.
namespace posed {

/// docs/configuration.md: every key of the configuration and of a camera calibration.
std::string configuration_reference();

/// config/posed.toml: a configuration with every key at its default, and comments.
std::string example_configuration();

/// A configuration file that says what `config` says, without comments. `config.intrinsics` is not in it: it comes from the
/// calibration.
std::string to_toml(const Config& config);

/// A camera calibration file.
std::string to_toml(const CameraIntrinsics& intrinsics);

}  // namespace posed
