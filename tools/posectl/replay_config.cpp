#include "tools/posectl/replay_config.h"

#include <system_error>

#include <fmt/format.h>

#include "config/config_loader.h"

namespace posed {
namespace {

bool is_missing(const std::filesystem::path& path) {
  std::error_code ignored;
  return !path.empty() && !std::filesystem::exists(path, ignored);
}

tl::unexpected<Error> not_found(const std::filesystem::path& path) {
  return make_error(ErrorCode::NotFound, fmt::format("{} does not exist", path.string()));
}

Status check_arguments(const ReplaySource& source) {
  if (!source.synthetic && source.sequence.empty() && source.config.empty()) {
    return make_error(ErrorCode::InvalidArgument, "nothing to replay: give --sequence DIR, --synthetic or --config FILE");
  }
  if (!source.sequence.empty() && source.camera.empty() && source.config.empty()) {
    return make_error(ErrorCode::InvalidArgument,
                      "a recording needs its camera: give --camera FILE, such as config/cameras/tum_fr1.toml, or --config FILE");
  }
  for (const std::filesystem::path& path : {source.config, source.sequence, source.associations}) {
    if (is_missing(path)) {
      return not_found(path);
    }
  }
  return {};
}

void apply_source(const ReplaySource& source, SourceConfig& config) {
  if (!source.sequence.empty()) {
    config.kind = SourceKind::Replay;
    config.replay.sequence = source.sequence.string();
    config.replay.associations = source.associations.string();
  }
  if (source.synthetic) {
    config.kind = SourceKind::Synthetic;
  }
  if (source.config.empty()) {
    config.synthetic.duration_s = kDefaultSyntheticDuration_s;
  }
  SyntheticConfig& synthetic = config.synthetic;
  synthetic.seed = source.seed.value_or(synthetic.seed);
  synthetic.mode = source.mode.value_or(synthetic.mode);
  synthetic.people = source.people.value_or(synthetic.people);
  synthetic.duration_s = source.duration_s.value_or(synthetic.duration_s);
  synthetic.sensor_noise = synthetic.sensor_noise && !source.no_noise;
  config.replay.loop = false;  // a replay ends
  config.pacing = source.lockstep ? Pacing::Lockstep : Pacing::Realtime;
}

}  // namespace

Result<Config> make_replay_config(const ReplaySource& source) {
  if (const Status status = check_arguments(source); !status) {
    return tl::unexpected(status.error());
  }
  Result<Config> config = source.config.empty() ? default_config() : load_config(source.config);
  if (!config) {
    return config;
  }
  apply_source(source, config->source);
  config->dynamic.mode = source.dynamic.value_or(config->dynamic.mode);
  if (!source.camera.empty()) {
    const Result<CameraIntrinsics> camera = load_camera(source.camera);
    if (!camera) {
      return tl::unexpected(camera.error());
    }
    config->camera.calibration = source.camera.string();
    config->intrinsics = *camera;
  }
  if (config->source.kind == SourceKind::Synthetic && config->source.synthetic.duration_s <= 0) {
    return make_error(
        ErrorCode::InvalidArgument,
        fmt::format("{}: source.synthetic.duration_s is 0, which has no end; give --duration", source.config.string()));
  }
  return config;
}

}  // namespace posed
