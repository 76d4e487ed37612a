#include "drivers/rgbd_source.h"

#include "drivers/replay_source.h"
#if __has_include("drivers/synthetic_source.h")
#include "drivers/synthetic_source.h"
#endif

namespace posed {

Result<std::unique_ptr<RgbdSource>> make_rgbd_source(const SourceConfig& config, const CameraIntrinsics& camera,
                                                     const Clock& clock) {
  switch (config.kind) {
    case SourceKind::Replay: return make_replay_source(config, camera, clock);
    case SourceKind::Synthetic:
#if __has_include("drivers/synthetic_source.h")
      return make_synthetic_source(config, camera, clock);
#else
      break;
#endif
  }
  return make_error(ErrorCode::Unsupported, "this build has no driver for the configured source");
}

}  // namespace posed
