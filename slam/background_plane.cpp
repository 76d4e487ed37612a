#include "slam/background_plane.h"

#include <cmath>
#include <cstdint>

#include <Eigen/Eigenvalues>

namespace posed {

namespace {

constexpr int kDraws = 60;              // a plane that holds a third of the points is missed once in ten
constexpr std::size_t kLookedAt = 256;  // points at most that a draw is judged by, evenly spread
constexpr int kRefinements = 2;
constexpr float kLeastSine = 0.1F;  // of the angle between two sides of a drawn triangle

std::size_t count_held(const Plane& plane, std::span<const Eigen::Vector3f> points, std::size_t step) {
  std::size_t held = 0;
  for (std::size_t i = 0; i < points.size(); i += step) {
    held += plane.holds(points[i]) ? 1 : 0;
  }
  return held;
}

std::optional<Plane> through(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c) {
  const Eigen::Vector3f u = b - a;
  const Eigen::Vector3f v = c - a;
  const Eigen::Vector3f normal = u.cross(v);
  if (!(normal.norm() > kLeastSine * u.norm() * v.norm()) || normal.norm() <= 0) {
    return std::nullopt;
  }
  const Eigen::Vector3f unit = normal.normalized();
  return Plane{unit, unit.dot(a)};
}

Plane fitted(const Plane& plane, std::span<const Eigen::Vector3f> points) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  int count = 0;
  for (const Eigen::Vector3f& p : points) {
    if (plane.holds(p)) {
      sum += p;
      ++count;
    }
  }
  const Eigen::Vector3f mean = sum / static_cast<float>(count);
  Eigen::Matrix3f scatter = Eigen::Matrix3f::Zero();
  for (const Eigen::Vector3f& p : points) {
    if (plane.holds(p)) {
      scatter += (p - mean) * (p - mean).transpose();
    }
  }
  const Eigen::Vector3f normal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f>(scatter).eigenvectors().col(0);
  return Plane{normal, normal.dot(mean)};
}

}  // namespace

std::optional<Plane> find_plane(std::span<const Eigen::Vector3f> points, float least_share) {
  constexpr std::size_t kTriangle = 3;
  if (points.size() < kTriangle) {
    return std::nullopt;
  }
  const std::size_t step = (points.size() + kLookedAt - 1) / kLookedAt;
  std::uint32_t state = 1;
  const auto draw = [&] {
    state = state * 1664525U + 1013904223U;  // Numerical Recipes' generator
    return points[(static_cast<std::uint64_t>(state) * points.size()) >> 32];
  };
  Plane best;
  std::size_t most = 0;
  for (int i = 0; i < kDraws; ++i) {
    const Eigen::Vector3f a = draw();
    const Eigen::Vector3f b = draw();
    const Eigen::Vector3f c = draw();
    if (const std::optional<Plane> plane = through(a, b, c)) {
      if (const std::size_t held = count_held(*plane, points, step); held > most) {
        most = held;
        best = *plane;
      }
    }
  }
  for (int i = 0; i < kRefinements && count_held(best, points, 1) >= kTriangle; ++i) {
    best = fitted(best, points);
  }
  const auto held = static_cast<float>(count_held(best, points, 1));
  return held >= least_share * static_cast<float>(points.size()) ? std::optional<Plane>(best) : std::nullopt;
}

}  // namespace posed
