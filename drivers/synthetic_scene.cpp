#include "drivers/synthetic_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>

#include <Eigen/Geometry>

#include "drivers/synthetic_hash.h"
#include "drivers/synthetic_materials.h"

namespace posed {

namespace {

constexpr float kPi = std::numbers::pi_v<float>;

/// A place on the floor with a heading: local x along a wall, y into the room.
struct Place {
  Eigen::Vector2f origin{0, 0};
  float yaw_rad = 0;

  Eigen::Vector2f to_world(Eigen::Vector2f local) const { return origin + Eigen::Rotation2Df(yaw_rad) * local; }
  Place at(float x, float y, float turn = 0) const { return {to_world({x, y}), yaw_rad + turn}; }
};

struct Box {
  Eigen::Vector3f base;  ///< middle of the underside, in the place's frame
  Eigen::Vector3f size;  ///< width (x), depth (y), height (z)
  std::uint32_t texture = 0;
  float turn_rad = 0;
};

enum class Furniture { Bookshelf, Desk, Cabinet, Cartons, LowShelf, Sofa, Chairs };

class SceneBuilder {
 public:
  explicit SceneBuilder(std::uint32_t seed) : rng_(seed) {
    wood_ = add_texture(paint_wood(2.4F, 2.0F, rng_.next()));
    cardboard_ = add_texture(paint_cardboard(1.6F, 1.2F, rng_.next()));
    covers_ = add_texture(paint_covers(2.0F, 1.2F, rng_.next()));
    upholstery_ = add_texture(paint_upholstery(2.0F, 1.2F, rng_.next()));
    metal_ = add_texture(paint_trousers(0.6F, 0.9F, rng_.next()));
  }

  void furnish_walls();
  void place_chairs(int count, float heading_rad);
  void close_room();
  SyntheticScene finish() && { return std::move(scene_); }

 private:
  std::uint32_t add_texture(MipTexture texture) {
    scene_.textures.push_back(std::move(texture));
    return static_cast<std::uint32_t>(scene_.textures.size() - 1);
  }

  void add_quad(Eigen::Vector3f corner, Eigen::Vector3f u, Eigen::Vector3f v, Eigen::Vector2f size, std::uint32_t texture,
                bool whole);
  void add_box(const Place& place, const Box& box);
  void add_picture(const Place& wall, float x, float z, float width, float height);

  float furnish(const Place& slot, Furniture kind);
  void bookshelf(const Place& slot, float width, float height, int rows);
  void desk(const Place& slot);
  void cabinet(const Place& slot, float width);
  void cartons(const Place& slot);
  void sofa(const Place& slot);
  void chair(const Place& place);
  void pile(const Place& place, float z, float width, float depth, int levels);

  HashRng rng_;
  SyntheticScene scene_;
  std::uint32_t wood_ = 0;
  std::uint32_t cardboard_ = 0;
  std::uint32_t covers_ = 0;
  std::uint32_t upholstery_ = 0;
  std::uint32_t metal_ = 0;
};

void SceneBuilder::add_quad(Eigen::Vector3f corner, Eigen::Vector3f u, Eigen::Vector3f v, Eigen::Vector2f size,
                            std::uint32_t texture, bool whole) {
  TexturedQuad quad{.corner = corner, .axis_u = u, .axis_v = v, .length_u_m = size.x(), .length_v_m = size.y(), .texture = texture};
  if (!whole) {  // a face takes any window of a sheet of material, so that no two faces look alike
    const MipTexture& sheet = scene_.textures[texture];
    const float across = rng_.uniform();
    const float down = rng_.uniform();
    quad.window_m = {across * std::max(sheet.width_m() - size.x(), 0.0F), down * std::max(sheet.height_m() - size.y(), 0.0F)};
  }
  quad.brightness = diffuse_brightness(quad.normal());
  scene_.quads.push_back(quad);
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
      if (axis == 2 && side < 0 && box.base.z() < 0.1F) {
        continue;  // nobody sees what stands on the floor from below
      }
      Eigen::Vector3f normal = Eigen::Vector3f::Zero();
      normal[axis] = side;
      const Eigen::Vector3f v = axis == 2 ? Eigen::Vector3f(0, -1, 0) : Eigen::Vector3f(0, 0, -1);
      const Eigen::Vector3f u = normal.cross(v);
      const Eigen::Vector2f size(2 * half.dot(u.cwiseAbs()), 2 * half.dot(v.cwiseAbs()));
      const Eigen::Vector3f corner = half.cwiseProduct(normal) - (u * size.x() + v * size.y()) / 2;
      add_quad(centre + R_world_box * corner, R_world_box * u, R_world_box * v, size, box.texture, false);
    }
  }
}

void SceneBuilder::add_picture(const Place& wall, float x, float z, float width, float height) {
  constexpr float kThickness_m = 0.02F;
  add_box(wall, {.base = {x, kThickness_m / 2, z}, .size = {width, kThickness_m, height}, .texture = metal_});
  // The picture itself, a little in front of its board; seen from the room its u runs towards the wall frame's -x.
  const std::uint32_t texture = add_texture(paint_poster(width, height, rng_.next()));
  const Eigen::Vector2f left = wall.to_world({x + width / 2, kThickness_m + 0.002F});
  const Eigen::Vector2f right = wall.to_world({x - width / 2, kThickness_m + 0.002F});
  const Eigen::Vector2f along = (right - left) / width;
  add_quad({left.x(), left.y(), z + height}, {along.x(), along.y(), 0}, {0, 0, -1}, {width, height}, texture, true);
}

void SceneBuilder::pile(const Place& place, float z, float width, float depth, int levels) {
  for (int i = 0; i < levels; ++i) {
    const float height = rng_.uniform(0.12F, 0.3F);
    const float w = width * rng_.uniform(0.65F, 1.0F);
    const float d = depth * rng_.uniform(0.65F, 0.9F);
    add_box(place, {.base = {0, 0, z}, .size = {w, d, height}, .texture = cardboard_, .turn_rad = rng_.uniform(-0.12F, 0.12F)});
    z += height;
  }
}

void SceneBuilder::bookshelf(const Place& slot, float width, float height, int rows) {
  constexpr float kDepth_m = 0.34F;
  constexpr float kBoard_m = 0.03F;
  const float pitch = (height - kBoard_m) / static_cast<float>(rows);
  add_box(slot, {.base = {0, 0.01F, 0}, .size = {width, 0.02F, height}, .texture = wood_});
  for (const float side : {-1.0F, 1.0F}) {
    const float x = side * (width - kBoard_m) / 2;
    add_box(slot, {.base = {x, kDepth_m / 2, 0}, .size = {kBoard_m, kDepth_m, height}, .texture = wood_});
  }
  for (int row = 0; row <= rows; ++row) {
    const float z = pitch * static_cast<float>(row);
    add_box(slot, {.base = {0, kDepth_m / 2, z}, .size = {width - 2 * kBoard_m, kDepth_m, kBoard_m}, .texture = wood_});
    if (row == rows) {
      break;
    }
    float x = -width / 2 + kBoard_m + 0.005F;
    while (x < width / 2 - 0.11F) {
      if (rng_.index(8) == 0) {
        x += rng_.uniform(0.08F, 0.2F);
        continue;
      }
      const float thickness = rng_.uniform(0.05F, 0.085F);
      const float tall = std::min(rng_.uniform(0.2F, 0.33F), pitch - 0.05F);
      const float deep = rng_.uniform(0.18F, 0.28F);
      add_box(slot,
              {.base = {x + thickness / 2, 0.02F + deep / 2, z + kBoard_m}, .size = {thickness, deep, tall}, .texture = covers_});
      x += thickness + 0.002F;
    }
  }
}

void SceneBuilder::desk(const Place& slot) {
  constexpr float kTop_m = 0.74F;
  add_box(slot, {.base = {0, 0.25F, kTop_m - 0.04F}, .size = {1.7F, 0.5F, 0.04F}, .texture = wood_});
  for (const float side : {-1.0F, 1.0F}) {
    add_box(slot, {.base = {side * 0.8F, 0.25F, 0}, .size = {0.05F, 0.46F, kTop_m - 0.04F}, .texture = metal_});
  }
  add_box(slot, {.base = {0.5F, 0.24F, 0}, .size = {0.4F, 0.42F, 0.55F}, .texture = cardboard_});
  const float x = rng_.uniform(-0.3F, 0.1F);
  add_box(slot, {.base = {x, 0.16F, kTop_m}, .size = {0.2F, 0.16F, 0.1F}, .texture = metal_});
  add_box(slot, {.base = {x, 0.16F, kTop_m + 0.1F}, .size = {0.56F, 0.05F, 0.36F}, .texture = metal_});
  const std::uint32_t screen = add_texture(paint_screen(0.54F, 0.34F, rng_.next()));
  const Eigen::Vector2f left = slot.to_world({x + 0.27F, 0.188F});
  const Eigen::Vector2f along = (slot.to_world({x - 0.27F, 0.188F}) - left) / 0.54F;
  add_quad({left.x(), left.y(), kTop_m + 0.45F}, {along.x(), along.y(), 0}, {0, 0, -1}, {0.54F, 0.34F}, screen, true);
  pile(slot.at(0.62F, 0.24F), kTop_m, 0.36F, 0.36F, 1);
  for (int i = 0; i < 4; ++i) {
    const float lateral = rng_.uniform(-0.75F, 0.4F);
    const float forward = rng_.uniform(0.3F, 0.4F);
    const float thickness = rng_.uniform(0.02F, 0.07F);
    const float turn = rng_.uniform(-0.6F, 0.6F);
    add_box(slot, {.base = {lateral, forward, kTop_m}, .size = {0.2F, 0.14F, thickness}, .texture = covers_, .turn_rad = turn});
  }
}

void SceneBuilder::cabinet(const Place& slot, float width) {
  const float height = rng_.uniform(0.85F, 1.1F);
  add_box(slot, {.base = {0, 0.21F, 0}, .size = {width, 0.42F, height}, .texture = wood_});
  const int drawers = 3;
  for (int i = 0; i < 2 * drawers; ++i) {
    const float x = (i % 2 == 0 ? -0.25F : 0.25F) * width;
    const float z = 0.05F + (height - 0.08F) / drawers * static_cast<float>(i / 2);
    const Eigen::Vector3f size(width * 0.46F, 0.02F, (height - 0.08F) / drawers - 0.03F);
    add_box(slot, {.base = {x, 0.43F, z}, .size = size, .texture = i % 3 == 1 ? upholstery_ : wood_});
    add_box(slot, {.base = {x, 0.445F, z + size.z() / 2}, .size = {0.12F, 0.02F, 0.025F}, .texture = metal_});
  }
  pile(slot.at(-0.25F * width, 0.21F), height, 0.42F, 0.36F, 2);
  pile(slot.at(0.25F * width, 0.21F), height, 0.4F, 0.34F, 1);
}

void SceneBuilder::cartons(const Place& slot) {
  for (const float x : {-0.52F, 0.0F, 0.52F}) {
    pile(slot.at(x, 0.25F, rng_.uniform(-0.08F, 0.08F)), 0, 0.46F, 0.44F, 2 + static_cast<int>(rng_.index(4)));
  }
}

void SceneBuilder::sofa(const Place& slot) {
  add_box(slot, {.base = {0, 0.25F, 0.08F}, .size = {1.7F, 0.48F, 0.34F}, .texture = upholstery_});
  add_box(slot, {.base = {0, 0.08F, 0.42F}, .size = {1.7F, 0.16F, 0.42F}, .texture = upholstery_});
  for (const float side : {-1.0F, 1.0F}) {
    add_box(slot, {.base = {side * 0.78F, 0.25F, 0.42F}, .size = {0.14F, 0.48F, 0.18F}, .texture = upholstery_});
    const float x = side * rng_.uniform(0.25F, 0.45F);
    add_box(slot, {.base = {x, 0.25F, 0.42F}, .size = {0.36F, 0.12F, 0.3F}, .texture = covers_, .turn_rad = side * 0.3F});
  }
}

void SceneBuilder::chair(const Place& place) {
  constexpr float kSeat_m = SyntheticScene::kSeatHeight_m;
  add_box(place, {.base = {0, 0, kSeat_m - 0.05F}, .size = {0.42F, 0.42F, 0.05F}, .texture = upholstery_});
  add_box(place, {.base = {0, -0.2F, kSeat_m + 0.1F}, .size = {0.4F, 0.03F, 0.32F}, .texture = upholstery_});
  for (const float side : {-1.0F, 1.0F}) {
    add_box(place, {.base = {side * 0.19F, 0.19F, 0}, .size = {0.035F, 0.035F, kSeat_m - 0.05F}, .texture = metal_});
    add_box(place, {.base = {side * 0.19F, -0.2F, 0}, .size = {0.035F, 0.035F, kSeat_m + 0.1F}, .texture = metal_});
  }
}

/// Puts a piece against the wall; its height, above which pictures can hang.
float SceneBuilder::furnish(const Place& slot, Furniture kind) {
  switch (kind) {
    case Furniture::Bookshelf: bookshelf(slot, rng_.uniform(1.3F, 1.6F), 1.95F, 5); return 1.95F;
    case Furniture::LowShelf:
      bookshelf(slot, 1.6F, 1.05F, 3);
      pile(slot.at(0.45F, 0.17F), 1.05F, 0.4F, 0.3F, 1);
      return 1.3F;
    case Furniture::Desk: desk(slot); return 1.25F;
    case Furniture::Cabinet: cabinet(slot, rng_.uniform(1.1F, 1.5F)); return 1.45F;
    case Furniture::Cartons: cartons(slot); return 1.2F;
    case Furniture::Sofa: sofa(slot); return 0.95F;
    case Furniture::Chairs:
      chair(slot.at(-0.4F, 0.25F, rng_.uniform(-0.15F, 0.15F)));
      chair(slot.at(0.4F, 0.25F, rng_.uniform(-0.15F, 0.15F)));
      return 0.95F;
  }
  return 0;
}

void SceneBuilder::furnish_walls() {
  constexpr float kX = SyntheticScene::kHalfLength_m;
  constexpr float kY = SyntheticScene::kHalfWidth_m;
  const std::array<Place, 4> walls{Place{{0, -kY}, 0}, Place{{kX, 0}, kPi / 2}, Place{{0, kY}, kPi}, Place{{-kX, 0}, -kPi / 2}};
  std::array<Furniture, 10> pieces{Furniture::Bookshelf, Furniture::Desk,   Furniture::Cabinet,   Furniture::Cartons,
                                   Furniture::LowShelf,  Furniture::Sofa,   Furniture::Bookshelf, Furniture::Desk,
                                   Furniture::Chairs,    Furniture::Cabinet};
  for (std::size_t i = pieces.size() - 1; i > 0; --i) {
    std::swap(pieces[i], pieces[rng_.index(static_cast<std::uint32_t>(i + 1))]);
  }
  constexpr std::array<float, 3> kLongWall{-1.95F, 0.0F, 1.95F};
  constexpr std::array<float, 2> kShortWall{-1.15F, 1.15F};
  std::size_t next = 0;
  for (std::size_t i = 0; i < walls.size(); ++i) {
    const std::span<const float> slots = i % 2 == 0 ? std::span<const float>(kLongWall) : std::span<const float>(kShortWall);
    for (const float x : slots) {
      const float top = furnish(walls[i].at(x, 0), pieces[next++]) + rng_.uniform(0.05F, 0.1F);
      const float room = 2.62F - top;
      if (room < 0.7F) {
        add_picture(walls[i], x, top, rng_.uniform(0.9F, 1.4F), room);
        continue;
      }
      for (const float side : {-1.0F, 1.0F}) {
        const float height = rng_.uniform(0.75F, 1.0F) * room;
        const float width = rng_.uniform(0.6F, 0.78F);
        const float bottom = top + rng_.uniform() * (room - height);
        add_picture(walls[i], x + side * 0.43F, bottom, width, height);
      }
    }
  }
}

void SceneBuilder::place_chairs(int count, float heading_rad) {
  constexpr std::array<float, SyntheticScene::kMaxSeats> kBearing{0.33F, -0.4F, 1.1F, -1.15F, 1.85F, -1.9F, 2.55F, -2.7F};
  for (int i = 0; i < std::min(count, SyntheticScene::kMaxSeats); ++i) {
    const float bearing = heading_rad + kBearing[static_cast<std::size_t>(i)];
    const Eigen::Vector2f position(2.0F * std::cos(bearing), 1.62F * std::sin(bearing));
    const float inward = std::atan2(-position.y(), -position.x()) + rng_.uniform(-0.6F, 0.6F);
    scene_.seats.push_back({.position = position, .yaw_rad = inward});
    chair({position, inward - kPi / 2});
  }
}

void SceneBuilder::close_room() {
  constexpr float kX = SyntheticScene::kHalfLength_m;
  constexpr float kY = SyntheticScene::kHalfWidth_m;
  constexpr float kZ = SyntheticScene::kHeight_m;
  const std::array<Eigen::Vector3f, 4> inward{Eigen::Vector3f{0, 1, 0}, {-1, 0, 0}, {0, -1, 0}, {1, 0, 0}};
  for (const Eigen::Vector3f& normal : inward) {
    const Eigen::Vector3f down(0, 0, -1);
    const Eigen::Vector3f right = normal.cross(down);
    const float half = std::abs(right.x()) * kX + std::abs(right.y()) * kY;
    const Eigen::Vector3f middle = -normal.cwiseProduct(Eigen::Vector3f(kX, kY, 0));
    const std::uint32_t texture = add_texture(paint_wall(2 * half, kZ, rng_.next()));
    add_quad(middle - right * half + Eigen::Vector3f(0, 0, kZ), right, down, {2 * half, kZ}, texture, true);
  }
  const std::uint32_t ceiling = add_texture(paint_ceiling(2 * kX, 2 * kY, rng_.next()));
  add_quad({-kX, -kY, kZ}, Eigen::Vector3f::UnitX(), Eigen::Vector3f::UnitY(), {2 * kX, 2 * kY}, ceiling, true);
  std::vector<FloorShadow> shadows;
  for (const SolidBox& box : scene_.solids) {
    if (box.centre.z() - box.half.z() < 0.1F) {  // the floor's texture has its y towards the world's -y
      shadows.push_back(
          {.centre = {kX + box.centre.x(), kY - box.centre.y()}, .half = box.half.head<2>(), .angle_rad = -box.yaw_rad});
    }
  }
  const std::uint32_t floor = add_texture(paint_floor(2 * kX, 2 * kY, shadows, rng_.next()));
  add_quad({-kX, kY, 0}, Eigen::Vector3f::UnitX(), -Eigen::Vector3f::UnitY(), {2 * kX, 2 * kY}, floor, true);
}

}  // namespace

float SyntheticScene::clearance(const Eigen::Vector3f& p_world) const {
  float nearest =
      std::min({kHalfLength_m - std::abs(p_world.x()), kHalfWidth_m - std::abs(p_world.y()), p_world.z(), kHeight_m - p_world.z()});
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

SyntheticScene build_synthetic_scene(std::uint32_t seed, int seats, float heading_rad) {
  SceneBuilder builder(hash32(seed, 0x5ce0eU));
  builder.furnish_walls();
  builder.place_chairs(seats, heading_rad);
  builder.close_room();
  return std::move(builder).finish();
}

}  // namespace posed
