#pragma once

#include <cmath>

namespace posed {

/// Whether two cells of a depth grid that lie side by side may show one surface: the step between them is no larger than a body's
/// curvature makes it [m]. A cell without depth belongs to none. Reentrant.
inline bool is_one_surface(float depth_m, float beside_m) {
  return depth_m > 0 && beside_m > 0 && std::abs(depth_m - beside_m) < 0.03F + 0.03F * depth_m;
}

}  // namespace posed
