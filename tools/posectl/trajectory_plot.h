#pragma once

#include <string>

#include "tools/posectl/trajectory.h"
#include "tools/posectl/trajectory_error.h"

namespace posed {

/// An SVG picture of the true trajectory and the aligned estimate, drawn in the plane of the two world axes along which the truth
/// moves most, to scale, with a line from each estimated position to its true one. Reentrant.
std::string plot_trajectories(const Trajectory& truth, const TrajectoryError& error);

}  // namespace posed
