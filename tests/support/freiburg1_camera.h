#pragma once

#include "core/pinhole_camera.h"

namespace posed {

/// The colour camera of the TUM RGB-D benchmark's first robot (freiburg1): the strongest distortion among the shipped calibrations.
inline CameraIntrinsics freiburg1_camera() {
  CameraIntrinsics k;
  k.fx = 517.306408;
  k.fy = 516.469215;
  k.cx = 318.643040;
  k.cy = 255.313989;
  k.k1 = 0.262383;
  k.k2 = -0.953104;
  k.p1 = -0.005358;
  k.p2 = 0.002628;
  k.k3 = 1.163314;
  return k;
}

}  // namespace posed
