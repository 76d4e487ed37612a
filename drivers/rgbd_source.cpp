#include "drivers/rgbd_source.h"

#include "drivers/replay_source.h"
#include "drivers/synthetic_source.h"

namespace posed {

Result<std::unique_ptr<RgbdSource>> make_rgbd_source(const SourceConfig& config, const CameraIntrinsics& camera,
                                                     const Clock& clock) {
  switch (config.kind) {
    case SourceKind::Replay: return make_replay_source(config, camera, clock);
    case SourceKind::Synthetic: return make_synthetic_source(config, camera, clock);
  }
  return make_error(ErrorCode::Unsupported, "this build has no driver for the configured source");
}

}  // namespace posed
