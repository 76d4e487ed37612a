#include "drivers/synthetic_scene.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace posed {

float SyntheticScene::clearance(const Eigen::Vector3f& p_world) const {
  float nearest = std::min({shell.half_m.x() - std::abs(p_world.x()), shell.half_m.y() - std::abs(p_world.y()), p_world.z(),
                            shell.height_m - p_world.z()});
  for (const SolidBox& box : solids) {
    const Eigen::Vector3f offset = p_world - box.centre;
    const Eigen::Vector2f level = Eigen::Rotation2Df(-box.yaw_rad) * offset.head<2>();
    const Eigen::Vector3f beyond = Eigen::Vector3f(level.x(), level.y(), offset.z()).cwiseAbs() - box.half;
    const float outside = beyond.cwiseMax(0.0F).norm();
    nearest = std::min(nearest, outside > 0 ? outside : beyond.maxCoeff());
  }
  return nearest;
}

float diffuse_brightness(const Eigen::Vector3f& normal_world) {
  static const Eigen::Vector3f to_light = Eigen::Vector3f(0.45F, 0.25F, 0.85F).normalized();
  return 0.7F + 0.3F * normal_world.dot(to_light);
}

}  // namespace posed
