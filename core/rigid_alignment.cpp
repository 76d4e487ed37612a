#include "core/rigid_alignment.h"

#include <cassert>

#include <Eigen/SVD>

namespace posed {

Se3 align_points(std::span<const Eigen::Vector3d> p_a, std::span<const Eigen::Vector3d> p_b) {
  assert(p_a.size() == p_b.size() && p_a.size() >= 3);
  Eigen::Vector3d mean_a = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean_b = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < p_a.size(); ++i) {
    mean_a += p_a[i];
    mean_b += p_b[i];
  }
  mean_a /= static_cast<double>(p_a.size());
  mean_b /= static_cast<double>(p_b.size());
  Eigen::Matrix3d correlation = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < p_a.size(); ++i) {
    correlation += (p_a[i] - mean_a) * (p_b[i] - mean_b).transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(correlation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  // A reflection fits mirrored points better, but no camera moves so.
  const double handedness = svd.matrixU().determinant() * svd.matrixV().determinant() < 0 ? -1.0 : 1.0;
  const Eigen::Matrix3d R_a_b = svd.matrixU() * Eigen::Vector3d(1, 1, handedness).asDiagonal() * svd.matrixV().transpose();
  return Se3(Eigen::Quaterniond(R_a_b), mean_a - R_a_b * mean_b);
}

}  // namespace posed
