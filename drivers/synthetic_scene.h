#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "drivers/synthetic_texture.h"

namespace posed {

/// A flat, textured rectangle. `axis_u` and `axis_v` are unit vectors (v is "down" on the texture); it is seen from the side to
/// which axis_v x axis_u points. World frame, metres.
struct TexturedQuad {
  Eigen::Vector3f corner;
  Eigen::Vector3f axis_u;
  Eigen::Vector3f axis_v;
  float length_u_m = 0;
  float length_v_m = 0;
  Eigen::Vector2f window_m{0, 0};  ///< where `corner` lies on the texture
  std::uint32_t texture = 0;
  float brightness = 1;  ///< diffuse shading under the world's fixed light

  Eigen::Vector3f normal() const { return axis_v.cross(axis_u); }
};

/// A box that stands upright, for clearances. World frame.
struct SolidBox {
  Eigen::Vector3f centre;
  Eigen::Vector3f half;
  float yaw_rad = 0;
};

/// Where somebody can sit: the middle of a chair's seat, and where it faces.
struct Seat {
  Eigen::Vector2f position;
  float yaw_rad = 0;
};

/// The space inside the outermost walls: x and y from minus to plus the half lengths, z from 0 to the height.
struct Shell {
  Eigen::Vector2f half_m{0, 0};
  float height_m = 0;
};

/// What never moves: shell, inner walls, furniture, pictures. Built from a seed once; immutable then, so thread-safe.
struct SyntheticScene {
  static constexpr float kSeatHeight_m = 0.45F;
  static constexpr int kMaxSeats = 8;

  Shell shell;
  std::vector<MipTexture> textures;
  std::vector<TexturedQuad> quads;
  std::vector<SolidBox> solids;
  std::vector<Seat> seats;

  /// Distance from a point inside the shell to the nearest surface that does not move [m]; negative inside walls and furniture.
  float clearance(const Eigen::Vector3f& p_world) const;
};

/// Diffuse shading, 0.4 to 1, of a surface with this unit normal under the world's light (half-Lambert, so that no side is black).
float diffuse_brightness(const Eigen::Vector3f& normal_world);

}  // namespace posed
