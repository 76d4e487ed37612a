#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "drivers/synthetic_texture.h"

namespace posed {

/// A colour for painting: blue, green, red in 0..255.
struct Colour {
  float b = 0;
  float g = 0;
  float r = 0;

  Colour operator*(float k) const { return {b * k, g * k, r * k}; }
};

/// Paints a texture of metres in size. Shapes are anti-aliased by their coverage (the signed distance of their edge, over one
/// texel), so the finest level is band-limited already. Origin is the upper left corner, y downwards. Thread-bound.
class TexturePainter {
 public:
  TexturePainter(float width_m, float height_m, float texel_m);

  float width_m() const { return width_m_; }
  float height_m() const { return height_m_; }

  void fill(Colour colour);

  /// Linear blend from the present colours to `bottom` at the lower edge.
  void gradient_to(Colour bottom);

  /// Multiplies the brightness by 1 + amplitude * noise, noise in [-1, 1]: `octaves` of value noise, the coarsest with cells of
  /// `cell_u_m` x `cell_v_m`, each next one half as large and 0.6 times as strong.
  void mottle(std::uint32_t seed, float cell_u_m, float cell_v_m, float amplitude, int octaves);

  /// `half_m` are half the side lengths, `angle_rad` turns x towards y.
  void rectangle(Eigen::Vector2f centre_m, Eigen::Vector2f half_m, float angle_rad, Colour colour, float opacity = 1.0F);
  void ellipse(Eigen::Vector2f centre_m, Eigen::Vector2f radii_m, float angle_rad, Colour colour, float opacity = 1.0F);
  void triangle(Eigen::Vector2f a_m, Eigen::Vector2f b_m, Eigen::Vector2f c_m, Colour colour, float opacity = 1.0F);

  /// Darkens a soft-edged rectangle: strength at the middle, fading over `fade_m` outside of it.
  void shadow(Eigen::Vector2f centre_m, Eigen::Vector2f half_m, float angle_rad, float fade_m, float strength);

  /// Darkens towards the outer edges, as corners of a room are.
  void darken_border(float fade_m, float strength);

  MipTexture finish() &&;

 private:
  template <typename Coverage>
  void blend(Eigen::Vector2f low_m, Eigen::Vector2f high_m, Colour colour, Coverage coverage);
  template <typename Brightness>
  void scale_all(Brightness brightness);

  float width_m_;
  float height_m_;
  int width_;
  int height_;
  Eigen::Vector2f texel_m_;
  std::vector<PackedBgr> texels_;
};

}  // namespace posed
