#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "core/pinhole_camera.h"
#include "core/result.h"
#include "drivers/encoded_frame.h"
#include "drivers/tum_writer.h"

namespace posed {

/// Where the frames of a recording go. Thread-bound to the writing thread; both calls may block for as long as the disk does.
class FrameSink {
 public:
  virtual ~FrameSink() = default;

  /// Takes a frame, which may be lost until `commit`. Error: Io.
  virtual Status add(const EncodedFrame& frame) = 0;

  /// Returns when neither a kill nor a power cut can take the frames that were added before. Also to be called after `add` failed:
  /// it then keeps the frames before. Error: Io.
  virtual Status commit() = 0;
};

/// A recording in the TUM RGB-D layout (drivers/tum_writer.h) with its calibration, `camera_file`, as camera.toml. Makes the
/// folders; nothing else stands in them before the first frame. Errors: InvalidArgument where a recording or a camera.toml is there
/// already; Io.
Result<std::unique_ptr<FrameSink>> make_tum_sink(const std::filesystem::path& folder, const EncodingOptions& options,
                                                 std::string camera_file);

/// An LCM log with a `posed.rgbd_frame_t` a frame on `channel`. Readers skip the torn last event that a kill can leave. Errors:
/// InvalidArgument where the file exists already; Io.
Result<std::unique_ptr<FrameSink>> make_lcm_log_sink(const std::filesystem::path& path, const std::string& channel,
                                                     const CameraIntrinsics& camera);

}  // namespace posed
