#pragma once

#include "core/estimates.h"
#include "core/rgbd_frame.h"
#include "slam/dynamic_mask.h"
#include "slam/features.h"

namespace posed {

/// What the tracker made of one frame, for tools that draw or judge it. Valid during the call alone.
struct TrackedView {
  const RgbdFrame& frame;
  const PoseEstimate& estimate;
  const DynamicMask* mask;   ///< null: everything was taken for static
  const Features* features;  ///< those that were kept; null: the tracker does not tell
};

}  // namespace posed
