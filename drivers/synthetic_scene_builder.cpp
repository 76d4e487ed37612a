#include "drivers/synthetic_scene_builder.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace posed {

namespace {

/// What is lower than this stands on the floor: it casts a shadow there, and nobody sees it from below.
constexpr float kOnFloor_m = 0.1F;

}  // namespace

std::array<Place, 4> sides_of(const FloorArea& area) {
  constexpr float kPi = std::numbers::pi_v<float>;
  const auto [x, y] = std::array{area.half.x(), area.half.y()};
  return {Place{area.centre - Eigen::Vector2f(0, y), 0}, Place{area.centre + Eigen::Vector2f(x, 0), kPi / 2},
          Place{area.centre + Eigen::Vector2f(0, y), kPi}, Place{area.centre - Eigen::Vector2f(x, 0), -kPi / 2}};
}

std::uint32_t SceneBuilder::add_texture(MipTexture texture) {
  scene_.textures.push_back(std::move(texture));
  return static_cast<std::uint32_t>(scene_.textures.size() - 1);
}

void SceneBuilder::add_quad(Eigen::Vector3f corner, Eigen::Vector3f u, Eigen::Vector3f v, Eigen::Vector2f size,
                            std::uint32_t texture, Eigen::Vector2f window_m) {
  TexturedQuad quad{.corner = corner,
                    .axis_u = u,
                    .axis_v = v,
                    .length_u_m = size.x(),
                    .length_v_m = size.y(),
                    .window_m = window_m,
                    .texture = texture};
  quad.brightness = diffuse_brightness(quad.normal());
  scene_.quads.push_back(quad);
}

Eigen::Vector2f SceneBuilder::any_window(std::uint32_t texture, Eigen::Vector2f size) {
  const MipTexture& sheet = scene_.textures[texture];
  const float across = rng_.uniform();
  const float down = rng_.uniform();
  return {across * std::max(sheet.width_m() - size.x(), 0.0F), down * std::max(sheet.height_m() - size.y(), 0.0F)};
}

void SceneBuilder::add_box(const Place& place, const Box& box) {
  const float yaw = place.yaw_rad + box.turn_rad;
  const Eigen::Vector2f middle = place.to_world(box.base.head<2>());
  const Eigen::Vector3f half = box.size / 2;
  const Eigen::Vector3f centre(middle.x(), middle.y(), box.base.z() + half.z());
  scene_.solids.push_back({.centre = centre, .half = half, .yaw_rad = yaw});

  const Eigen::Matrix3f R_world_box = Eigen::AngleAxisf(yaw, Eigen::Vector3f::UnitZ()).toRotationMatrix();
  for (int axis = 0; axis < 3; ++axis) {
    for (const float side : {-1.0F, 1.0F}) {
      if (axis == 2 && side < 0 && box.base.z() < kOnFloor_m) {
        continue;
      }
      Eigen::Vector3f normal = Eigen::Vector3f::Zero();
      normal[axis] = side;
      const Eigen::Vector3f v = axis == 2 ? Eigen::Vector3f(0, -1, 0) : Eigen::Vector3f(0, 0, -1);
      const Eigen::Vector3f u = normal.cross(v);
      const Eigen::Vector2f size(2 * half.dot(u.cwiseAbs()), 2 * half.dot(v.cwiseAbs()));
      const Eigen::Vector3f corner = half.cwiseProduct(normal) - (u * size.x() + v * size.y()) / 2;
      add_quad(centre + R_world_box * corner, R_world_box * u, R_world_box * v, size, box.texture, any_window(box.texture, size));
    }
  }
}

void SceneBuilder::add_panel(const Place& place, const Panel& panel, std::uint32_t texture) {
  // Seen from +y, the panel's u runs towards the place's -x.
  const float width = panel.size.x();
  const Eigen::Vector2f left = place.to_world({panel.head.x() + width / 2, panel.head.y()});
  const Eigen::Vector2f right = place.to_world({panel.head.x() - width / 2, panel.head.y()});
  const Eigen::Vector2f along = (right - left) / width;
  add_quad({left.x(), left.y(), panel.head.z()}, {along.x(), along.y(), 0}, {0, 0, -1}, panel.size, texture, {0, 0});
}

void SceneBuilder::add_wall(Eigen::Vector2f middle, Eigen::Vector2f inward, float length_m, std::uint32_t texture) {
  const Eigen::Vector3f down(0, 0, -1);
  const Eigen::Vector3f right = Eigen::Vector3f(inward.x(), inward.y(), 0).cross(down);
  const float height = scene_.shell.height_m;
  const Eigen::Vector3f corner = Eigen::Vector3f(middle.x(), middle.y(), height) - right * (length_m / 2);
  add_quad(corner, right, down, {length_m, height}, texture, {0, 0});
}

void SceneBuilder::add_painted_wall(Eigen::Vector2f middle, Eigen::Vector2f inward, float length_m) {
  add_wall(middle, inward, length_m, add_texture(paint_wall(length_m, scene_.shell.height_m, rng_.next())));
}

void SceneBuilder::add_painted_walls(const FloorArea& area) {
  const std::array<Eigen::Vector2f, 4> inward{Eigen::Vector2f{0, 1}, {-1, 0}, {0, -1}, {1, 0}};
  for (const Eigen::Vector2f& normal : inward) {
    const float half = std::abs(normal.y()) * area.half.x() + std::abs(normal.x()) * area.half.y();
    add_painted_wall(area.centre - normal.cwiseProduct(area.half), normal, 2 * half);
  }
}

void SceneBuilder::add_solid_block(const FloorArea& area) {
  const float half_height = scene_.shell.height_m / 2;
  scene_.solids.push_back(
      {.centre = {area.centre.x(), area.centre.y(), half_height}, .half = {area.half.x(), area.half.y(), half_height}});
}

void SceneBuilder::add_ceiling(const FloorArea& area, std::uint32_t texture) {
  const Eigen::Vector2f corner = area.centre - area.half;
  add_quad({corner.x(), corner.y(), scene_.shell.height_m}, Eigen::Vector3f::UnitX(), Eigen::Vector3f::UnitY(), 2 * area.half,
           texture, {0, 0});
}

void SceneBuilder::add_floor(const FloorArea& area, std::uint32_t texture) {
  add_quad({area.centre.x() - area.half.x(), area.centre.y() + area.half.y(), 0}, Eigen::Vector3f::UnitX(),
           -Eigen::Vector3f::UnitY(), 2 * area.half, texture, {0, 0});
}

std::vector<FloorShadow> SceneBuilder::shadows_on(const FloorArea& area) const {
  std::vector<FloorShadow> shadows;
  for (const SolidBox& box : scene_.solids) {
    if (box.centre.z() - box.half.z() < kOnFloor_m) {  // the floor's texture has its y towards the world's -y
      const Eigen::Vector2f offset = box.centre.head<2>() - area.centre;
      shadows.push_back({.centre = {area.half.x() + offset.x(), area.half.y() - offset.y()},
                         .half = box.half.head<2>(),
                         .angle_rad = -box.yaw_rad});
    }
  }
  return shadows;
}

void SceneBuilder::repeat_half_turned() {
  const auto turned = [](const Eigen::Vector3f& p) { return Eigen::Vector3f(-p.x(), -p.y(), p.z()); };
  const std::size_t quads = scene_.quads.size();
  for (std::size_t i = 0; i < quads; ++i) {
    TexturedQuad quad = scene_.quads[i];
    quad.corner = turned(quad.corner);
    quad.axis_u = turned(quad.axis_u);
    quad.axis_v = turned(quad.axis_v);
    scene_.quads.push_back(quad);
  }
  const std::size_t solids = scene_.solids.size();
  for (std::size_t i = 0; i < solids; ++i) {
    SolidBox box = scene_.solids[i];
    box.centre = turned(box.centre);  // a box looks the same after half a turn around its own middle
    scene_.solids.push_back(box);
  }
}

SyntheticScene SceneBuilder::finish() && {
  return std::move(scene_);
}

}  // namespace posed
