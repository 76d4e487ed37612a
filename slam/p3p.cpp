#include "slam/p3p.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Dense>

#include "core/rigid_alignment.h"

namespace posed {

namespace {

/// The matrix Q_ij with lambda^T Q_ij lambda = |lambda_i ray_i - lambda_j ray_j|^2.
Eigen::Matrix3d squared_distance(int i, int j, double cosine) {
  Eigen::Matrix3d q = Eigen::Matrix3d::Zero();
  q(i, i) = q(j, j) = 1;
  q(i, j) = q(j, i) = -cosine;
  return q;
}

Eigen::Matrix3d adjugate(const Eigen::Matrix3d& m) {
  Eigen::Matrix3d a;
  a.row(0) = m.col(1).cross(m.col(2)).transpose();
  a.row(1) = m.col(2).cross(m.col(0)).transpose();
  a.row(2) = m.col(0).cross(m.col(1)).transpose();
  return a;
}

/// One real root of x^3 + b x^2 + c x + d: the closed form, then Newton's steps against its rounding.
double cubic_root(double b, double c, double d) {
  const double shift = b / 3;
  const double p = (c - b * shift) / 3;
  const double q = (shift * (2 * shift * shift - c) + d) / 2;  // y^3 + 3 p y + 2 q with x = y - shift
  const double discriminant = q * q + p * p * p;
  double y = 0;
  if (discriminant > 0) {
    const double u = -std::copysign(std::cbrt(std::abs(q) + std::sqrt(discriminant)), q);
    y = u == 0 ? 0 : u - p / u;
  } else if (p < 0) {
    const double r = std::sqrt(-p);
    y = 2 * r * std::cos(std::acos(std::clamp(-q / (r * r * r), -1.0, 1.0)) / 3);
  }
  double x = y - shift;
  for (int i = 0; i < 3; ++i) {
    const double slope = (3 * x + 2 * b) * x + c;
    if (slope == 0) {
      break;
    }
    x -= (((x + b) * x + c) * x + d) / slope;
  }
  return x;
}

/// Newton's steps for the three distances' equations lambda^T Q_k lambda = a_k.
void polish(const std::array<Eigen::Matrix3d, 3>& quadrics, const Eigen::Vector3d& squared_distances, Eigen::Vector3d& lambda) {
  constexpr int kSteps = 3;
  for (int step = 0; step < kSteps; ++step) {
    Eigen::Vector3d error;
    Eigen::Matrix3d jacobian;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d half_gradient = quadrics[static_cast<std::size_t>(k)] * lambda;
      error[k] = lambda.dot(half_gradient) - squared_distances[k];
      jacobian.row(k) = 2 * half_gradient.transpose();
    }
    const Eigen::Vector3d improved = lambda - jacobian.partialPivLu().solve(error);
    if (!improved.allFinite()) {
      return;
    }
    lambda = improved;
  }
}

}  // namespace

P3pSolutions solve_p3p(std::span<const Eigen::Vector3d, 3> p_map, std::span<const Eigen::Vector3d, 3> ray_camera) {
  P3pSolutions solutions;
  const Eigen::Vector3d a{(p_map[0] - p_map[1]).squaredNorm(), (p_map[0] - p_map[2]).squaredNorm(),
                          (p_map[1] - p_map[2]).squaredNorm()};
  const std::array<Eigen::Matrix3d, 3> q = {squared_distance(0, 1, ray_camera[0].dot(ray_camera[1])),
                                            squared_distance(0, 2, ray_camera[0].dot(ray_camera[2])),
                                            squared_distance(1, 2, ray_camera[1].dot(ray_camera[2]))};
  // Both vanish at a solution, whatever the scale of lambda; so does every d1 + gamma * d2.
  const Eigen::Matrix3d d1 = q[0] * a[2] - q[2] * a[0];
  const Eigen::Matrix3d d2 = q[1] * a[2] - q[2] * a[1];
  const double c3 = d2.determinant();
  if (std::abs(c3) < 1e-12 * a.prod() || !(a.minCoeff() > 0)) {
    return solutions;
  }
  const double gamma = cubic_root((adjugate(d2) * d1).trace() / c3, (adjugate(d1) * d2).trace() / c3, d1.determinant() / c3);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(d1 + gamma * d2);
  // The eigenvalues ascend; the one next to zero is in the middle where the quadric is a pair of real planes.
  const double low = std::max(0.0, -eigen.eigenvalues()[0]);
  const double high = std::max(0.0, eigen.eigenvalues()[2]);
  for (const double sign : {-1.0, 1.0}) {
    const Eigen::Vector3d normal =
        std::sqrt(high) * eigen.eigenvectors().col(2) + sign * std::sqrt(low) * eigen.eigenvectors().col(0);
    // Lambda lies in the plane: lambda = s u + t v, and one quadric of the pencil settles s : t.
    const Eigen::Vector3d u = normal.unitOrthogonal();
    const Eigen::Vector3d v = normal.cross(u).normalized();
    const double uu = u.dot(d2 * u);
    const double uv = u.dot(d2 * v);
    const double vv = v.dot(d2 * v);
    const double discriminant = uv * uv - uu * vv;
    if (discriminant < 0) {
      continue;
    }
    const double root = std::sqrt(discriminant);
    // s : t of uu s^2 + 2 uv s t + vv t^2 = 0, in the form that subtracts nothing of equal size.
    const double sum = -(uv + std::copysign(root, uv));
    for (const Eigen::Vector2d& st : {Eigen::Vector2d(sum, uu), Eigen::Vector2d(vv, sum)}) {
      Eigen::Vector3d lambda = st.x() * u + st.y() * v;
      lambda *= std::copysign(1.0, lambda.sum());
      const double scale = lambda.dot((q[0] + q[1] + q[2]) * lambda);
      if (!(lambda.minCoeff() > 0) || !(scale > 0) || solutions.count == 4) {
        continue;
      }
      lambda *= std::sqrt(a.sum() / scale);
      polish(q, a, lambda);
      const std::array<Eigen::Vector3d, 3> p_camera = {lambda[0] * ray_camera[0], lambda[1] * ray_camera[1],
                                                       lambda[2] * ray_camera[2]};
      const Se3 T_map_camera = align_points(p_map, p_camera);
      if (T_map_camera.is_finite()) {
        solutions.T_map_camera[static_cast<std::size_t>(solutions.count++)] = T_map_camera;
      }
    }
  }
  return solutions;
}

}  // namespace posed
