#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "drivers/synthetic_hash.h"
#include "drivers/synthetic_materials.h"
#include "drivers/synthetic_scene.h"

namespace posed {

/// A place on the floor with a heading: local x along a wall, y away from it into the room.
struct Place {
  Eigen::Vector2f origin{0, 0};
  float yaw_rad = 0;

  Eigen::Vector2f to_world(Eigen::Vector2f local) const { return origin + Eigen::Rotation2Df(yaw_rad) * local; }
  Place at(float x, float y, float turn = 0) const { return {to_world({x, y}), yaw_rad + turn}; }
};

/// An upright box at a place.
struct Box {
  Eigen::Vector3f base;  ///< middle of the underside, in the place's frame
  Eigen::Vector3f size;  ///< width (x), depth (y), height (z)
  std::uint32_t texture = 0;
  float turn_rad = 0;
};

/// Something flat before a wall: a picture, a door, a screen.
struct Panel {
  Eigen::Vector3f head;  ///< middle of its upper edge, in the place's frame; it is seen from the place's +y
  Eigen::Vector2f size;  ///< width, height
};

/// A rectangle on the floor or the ceiling, sides along the world's x and y.
struct FloorArea {
  Eigen::Vector2f centre{0, 0};
  Eigen::Vector2f half{0, 0};
};

/// The four sides of an area as places that face its middle: south (y lowest), east, north, west.
std::array<Place, 4> sides_of(const FloorArea& area);

/// Puts a scene together from boxes, walls and panels, and is the stream of random numbers that the scene is drawn from.
/// Thread-bound.
class SceneBuilder {
 public:
  SceneBuilder(std::uint32_t seed, Shell shell) : rng_(seed) { scene_.shell = shell; }

  HashRng& rng() { return rng_; }
  const Shell& shell() const { return scene_.shell; }

  /// Index of the texture for quads and boxes.
  std::uint32_t add_texture(MipTexture texture);

  /// A box whose faces show windows of the texture, at random places, so that no two faces look alike.
  void add_box(const Place& place, const Box& box);

  /// Shows the whole texture.
  void add_panel(const Place& place, const Panel& panel, std::uint32_t texture);

  /// A wall from floor to ceiling that shows the whole texture, seen from the side to which the unit vector `inward` points.
  void add_wall(Eigen::Vector2f middle, Eigen::Vector2f inward, float length_m, std::uint32_t texture);

  /// The same, with a wall's texture painted for it.
  void add_painted_wall(Eigen::Vector2f middle, Eigen::Vector2f inward, float length_m);

  /// Painted walls all around an area, seen from inside.
  void add_painted_walls(const FloorArea& area);

  /// What fills an area from floor to ceiling and cannot be seen itself: the inside of walls.
  void add_solid_block(const FloorArea& area);

  void add_ceiling(const FloorArea& area, std::uint32_t texture);
  void add_floor(const FloorArea& area, std::uint32_t texture);

  /// Shadows on the floor's texture of the boxes that are there now and stand on `area`'s floor.
  std::vector<FloorShadow> shadows_on(const FloorArea& area) const;

  void add_seat(const Seat& seat) { scene_.seats.push_back(seat); }

  /// Everything that is there now once more, turned by half a turn around the world's z axis: the same textures, windows and
  /// shading.
  void repeat_half_turned();

  SyntheticScene finish() &&;

 private:
  void add_quad(Eigen::Vector3f corner, Eigen::Vector3f u, Eigen::Vector3f v, Eigen::Vector2f size, std::uint32_t texture,
                Eigen::Vector2f window_m);
  Eigen::Vector2f any_window(std::uint32_t texture, Eigen::Vector2f size);

  HashRng rng_;
  SyntheticScene scene_;
};

}  // namespace posed
