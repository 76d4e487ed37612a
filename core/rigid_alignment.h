#pragma once

#include <span>

#include <Eigen/Core>

#include "core/se3.h"

namespace posed {

/// The rigid transform that brings points `p_b` onto `p_a` with least squared distance: minimises sum |p_a - T_a_b * p_b|^2. Both
/// spans have the same length, at least 3; points on one line leave the rotation about it undetermined. Source: Umeyama,
/// "Least-squares estimation of transformation parameters between two point patterns", PAMI 1991, without scale. Does not allocate.
/// Reentrant.
Se3 align_points(std::span<const Eigen::Vector3d> p_a, std::span<const Eigen::Vector3d> p_b);

}  // namespace posed
