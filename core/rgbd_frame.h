#pragma once

#include <cstdint>
#include <optional>

#include "core/clock.h"
#include "core/image_view.h"
#include "core/se3.h"

namespace posed {

/// One RGB-D frame, depth registered to colour. The pixels belong to a slot of a `FramePool`; once the frame is shared nobody
/// writes to it, so any thread may read it.
struct RgbdFrame {
  std::uint64_t sequence = 0;     ///< counts the source's frames from 0; a gap is a frame lost before the pool
  TimeNs capture_ns = 0;          ///< monotonic time of capture; in paced replay, the instant the frame was due
  std::int64_t stamp_utc_ns = 0;  ///< capture time since 1970 UTC; for a recording, the colour image's stamp in its list

  /// When the depth image was taken, counted from the colour image: negative where it was before. Its pixels show what was there
  /// then.
  TimeNs depth_offset_ns = 0;

  ImageView<std::uint8_t> bgr;   ///< 3 channels, 8 bit
  ImageView<std::uint8_t> gray;  ///< 1 channel, 8 bit; made by the source, which often has it for free (YUYV, NV12, JPEG)
  ImageView<float> depth_m;      ///< metres along z; 0 is invalid

  std::optional<Se3> T_world_camera_truth;  ///< only from simulated sources, and read only by evaluation
};

}  // namespace posed
