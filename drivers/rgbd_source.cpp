#include "drivers/rgbd_source.h"

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "drivers/fault_injection.h"
#include "drivers/replay_source.h"
#include "drivers/synthetic_source.h"
#ifdef POSED_HAS_OPENNI2
#include "drivers/openni2/openni2_source.h"
#endif
#ifdef POSED_HAS_V4L2
#include "drivers/v4l2/v4l2_source.h"
#endif
#ifdef POSED_HAS_LIBCAMERA
#include "drivers/libcamera/libcamera_source.h"
#endif

namespace posed {

namespace {

[[maybe_unused]] tl::unexpected<Error> left_out(std::string_view kind, std::string_view option) {
  return make_error(ErrorCode::Unsupported,
                    fmt::format("source.kind = \"{}\": this build was made without it (CMake option {})", kind, option));
}

Result<std::unique_ptr<RgbdSource>> make_sound_source(const SourceConfig& config, const CameraIntrinsics& camera,
                                                      const Clock& clock) {
  switch (config.kind) {
    case SourceKind::Replay: return make_replay_source(config, camera, clock);
    case SourceKind::Synthetic: return make_synthetic_source(config, camera, clock);
    case SourceKind::OpenNi2:
#ifdef POSED_HAS_OPENNI2
      return make_openni2_source(config, camera, clock);
#else
      return left_out("openni2", "POSED_OPENNI2");
#endif
    case SourceKind::V4l2:
#ifdef POSED_HAS_V4L2
      return make_v4l2_source(config, camera, clock);
#else
      return left_out("v4l2", "POSED_V4L2");
#endif
    case SourceKind::Libcamera:
#ifdef POSED_HAS_LIBCAMERA
      return make_libcamera_source(config, camera, clock);
#else
      return left_out("libcamera", "POSED_LIBCAMERA");
#endif
  }
  return make_error(ErrorCode::InvalidArgument, "source.kind has no meaning");
}

}  // namespace

Result<std::unique_ptr<RgbdSource>> make_rgbd_source(const SourceConfig& config, const CameraIntrinsics& camera,
                                                     const Clock& clock) {
  std::vector<Fault> faults;
  for (const std::string& text : config.faults) {
    const Result<Fault> fault = parse_fault(text);
    if (!fault) {
      return tl::unexpected(fault.error());
    }
    faults.push_back(*fault);
  }
  Result<std::unique_ptr<RgbdSource>> source = make_sound_source(config, camera, clock);
  if (!source || faults.empty()) {
    return source;
  }
  return with_faults(std::move(*source), std::move(faults), clock);
}

}  // namespace posed
