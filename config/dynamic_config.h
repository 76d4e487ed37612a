#pragma once

/// The part of the configuration (config/config.h) that says how what moves is kept out of the geometry.
namespace posed {

enum class DynamicMode {
  Off,    ///< everything is taken for the static world
  Boxes,  ///< whole boxes of detected people are left out, as the source paper does
  Full,   ///< people are cut out by depth and carried from frame to frame, and what moves without being a person is left out, too
};

struct DynamicConfig {
  DynamicMode mode = DynamicMode::Full;
  double max_detection_age_s = 0.5;  ///< older detections are not used
  double memory_s = 1.5;             ///< a mover that nothing confirms for so long is taken for static again
  int lockstep_lag = 2;              ///< frames by which detections come late in lockstep
};

}  // namespace posed
