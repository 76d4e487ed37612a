#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "config/config.h"
#include "core/result.h"

namespace posed {

/// What the command line of `posectl replay` says of the source. Whatever is not given comes from the configuration file, or else
/// from the defaults.
struct ReplaySource {
  std::filesystem::path config;
  std::filesystem::path camera;
  std::filesystem::path sequence;
  std::filesystem::path associations;
  bool synthetic = false;
  bool lockstep = false;
  std::optional<std::int64_t> seed;
  std::optional<SyntheticMode> mode;
  std::optional<int> people;
  std::optional<double> duration_s;
  bool no_noise = false;
  std::optional<DynamicMode> dynamic;
};

/// How long the synthetic source runs where neither the command line nor a configuration file says.
constexpr double kDefaultSyntheticDuration_s = 20.0;

/// The pipeline's configuration for a replay. Errors: those of `load_config` and `load_camera`; NotFound for a file or folder that
/// does not exist; InvalidArgument for a source that is not determined or has no end. Reentrant.
Result<Config> make_replay_config(const ReplaySource& source);

}  // namespace posed
