#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "core/pinhole_camera.h"
#include "drivers/synthetic_person.h"
#include "drivers/synthetic_scene.h"

/// The world's primitives as one camera sees them at one moment, ready to be met by rays. A ray is named by its ideal (undistorted)
/// pixel (x, y): p_camera = z * ((x - cx) / fx, (y - cy) / fy, 1). All types are values; reentrant.
namespace posed {

/// Camera and world at one moment: p_camera = R_camera_world * p_world + t.
struct CameraView {
  Eigen::Matrix3f R_camera_world;
  Eigen::Vector3f t_camera_world;
  float fx, fy, cx, cy;

  Eigen::Vector3f to_camera(const Eigen::Vector3f& p_world) const { return R_camera_world * p_world + t_camera_world; }
};

/// Rectangle of ideal pixels.
struct PixelBox {
  float min_x, min_y, max_x, max_y;

  bool overlaps(const PixelBox& o) const { return min_x <= o.max_x && o.min_x <= max_x && min_y <= o.max_y && o.min_y <= max_y; }
  bool contains(float x, float y) const { return x >= min_x && x <= max_x && y >= min_y && y <= max_y; }
};

/// An affine function of the ideal pixel.
struct AffineFunction {
  float a = 0, b = 0, c = 0;

  float operator()(float x, float y) const { return a * x + b * y + c; }
  float min_over(const PixelBox& box) const {
    return a * (a > 0 ? box.min_x : box.max_x) + b * (b > 0 ? box.min_y : box.max_y) + c;
  }
  float max_over(const PixelBox& box) const {
    return a * (a > 0 ? box.max_x : box.min_x) + b * (b > 0 ? box.max_y : box.min_y) + c;
  }
  AffineFunction minus(const AffineFunction& other, float factor) const {
    return {a - factor * other.a, b - factor * other.b, c - factor * other.c};
  }
};

/// A textured rectangle. On a plane 1/z, u/z and v/z are affine in the pixel, so a ray is met without a division, and whole tiles
/// are accepted or rejected by their corners.
struct ViewedQuad {
  AffineFunction inverse_z;
  AffineFunction u_by_z, v_by_z;     ///< texels of level 0, over z
  float u_min, u_max, v_min, v_max;  ///< texels
  PixelBox bounds;
  const MipTexture* texture;
  std::uint32_t brightness_q8;  ///< 0..256

  /// False where the camera cannot see it (turned away or out of the image).
  static bool view(const TexturedQuad& quad, const MipTexture& texture, const CameraView& camera, const PixelBox& image,
                   ViewedQuad& out);

  enum class Overlap { None, Partial, Full };
  Overlap overlap(const PixelBox& tile) const;

  /// Colour averaged over a square of side `pixel` [pixels] around (x, y).
  PackedBgr colour(float x, float y, float pixel) const;
};

/// A rounded cone (convex hull of two spheres), in coordinates in which its squeeze is undone.
struct ViewedPart {
  Eigen::Vector3f origin;                                 ///< of all rays
  Eigen::Vector3f direction_x, direction_y, direction_c;  ///< direction(x, y) = direction_x * x + direction_y * y + direction_c
  float length, base_radius, tip_radius;
  float slope_sin, slope_cos;  ///< of the angle between axis and side
  Eigen::Matrix3f R_world_part;
  Eigen::Vector2f squeeze;
  PixelBox bounds;
  float nearest_z;         ///< no point of it is nearer
  float texels_per_pixel;  ///< at z = 1, seen straight on
  const MipTexture* texture;

  static bool view(const BodyPart& part, const MipTexture& texture, const CameraView& camera, const PixelBox& image,
                   ViewedPart& out);

  Eigen::Vector3f direction(float x, float y) const { return direction_x * x + direction_y * y + direction_c; }

  /// Depth z of the first meeting, 0 where the ray misses.
  float meet(float x, float y) const;

  /// Colour at depth `z`, as `meet` returned it.
  PackedBgr colour(float x, float y, float z, float pixel) const;
};

/// Multiplies the three channels by k_q8 / 256, k_q8 <= 256.
inline PackedBgr scaled(PackedBgr c, std::uint32_t k_q8) {
  const std::uint32_t even = ((c & 0x00ff00ffU) * k_q8 >> 8) & 0x00ff00ffU;
  const std::uint32_t odd = ((c >> 8 & 0xffU) * k_q8) & 0xff00U;
  return even | odd;
}

}  // namespace posed
