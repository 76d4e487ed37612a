#include "drivers/synthetic_motifs.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace posed {

Colour from_hue(float hue, float saturation, float brightness) {
  const auto channel = [&](float offset) {
    const float position = hue + offset - std::floor(hue + offset);
    const float ramp = std::clamp(std::abs(position * 6.0F - 3.0F) - 1.0F, 0.0F, 1.0F);
    return 255.0F * brightness * (1.0F - saturation * (1.0F - ramp));
  };
  return {.b = channel(1.0F / 3.0F), .g = channel(2.0F / 3.0F), .r = channel(0.0F)};
}

Colour any_colour(HashRng& rng, float saturation, float dark, float bright) {
  const float hue = rng.uniform();
  const float strength = saturation * rng.uniform(0.3F, 1.0F);
  return from_hue(hue, strength, rng.uniform(dark, bright));
}

float any_size(HashRng& rng, float low, float high) {
  return low * std::pow(high / low, rng.uniform());
}

Eigen::Vector2f any_point(HashRng& rng, const TexturePainter& painter) {
  const float x = rng.uniform(0, painter.width_m());
  return {x, rng.uniform(0, painter.height_m())};
}

void any_shape(TexturePainter& painter, HashRng& rng, Eigen::Vector2f centre, float size, Colour colour, float opacity) {
  const float angle = rng.uniform(0, std::numbers::pi_v<float>);
  const float aspect = rng.uniform(0.45F, 1.0F);
  switch (rng.index(4)) {
    case 0: painter.ellipse(centre, {size / 2, size / 2 * aspect}, angle, colour, opacity); break;
    case 1: {
      const auto corner = [&](float turn) -> Eigen::Vector2f {
        return centre + 0.55F * size * Eigen::Vector2f(std::cos(angle + turn), aspect * std::sin(angle + turn));
      };
      painter.triangle(corner(0), corner(2.0F), corner(4.2F), colour, opacity);
      break;
    }
    default: painter.rectangle(centre, {size / 2, size / 2 * aspect}, angle, colour, opacity); break;
  }
}

void scatter(TexturePainter& painter, HashRng& rng, int count, float low_m, float high_m, float opacity, float saturation) {
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector2f centre = any_point(rng, painter);
    const float size = any_size(rng, low_m, high_m);
    const Colour colour = any_colour(rng, saturation, 0.1F, 1.0F);
    any_shape(painter, rng, centre, size, colour, opacity);
  }
}

void print_text(TexturePainter& painter, HashRng& rng, Eigen::Vector2f origin, Eigen::Vector2f size, float cell_m, Colour ink) {
  for (float y = origin.y(); y + 4 * cell_m <= origin.y() + size.y(); y += 6 * cell_m) {
    for (float x = origin.x(); x + 3 * cell_m <= origin.x() + size.x(); x += 4 * cell_m) {
      const std::uint32_t glyph = rng.next();
      if ((glyph >> 28) < 2) {
        continue;  // the gap between words
      }
      for (std::uint32_t bit = 0; bit < 12; ++bit) {
        if ((glyph >> bit & 1U) != 0) {
          const Eigen::Vector2f centre(x + (static_cast<float>(bit % 3) + 0.5F) * cell_m,
                                       y + (static_cast<float>(bit / 3) + 0.5F) * cell_m);
          painter.rectangle(centre, {cell_m * 0.55F, cell_m * 0.55F}, 0, ink);
        }
      }
    }
  }
}

int count_for(const TexturePainter& painter, float per_square_metre) {
  return static_cast<int>(painter.width_m() * painter.height_m() * per_square_metre);
}

void shade_floor(TexturePainter& painter, std::span<const FloorShadow> shadows) {
  for (const FloorShadow& shadow : shadows) {
    painter.shadow(shadow.centre, shadow.half, shadow.angle_rad, 0.18F, 0.45F);
  }
  painter.darken_border(0.4F, 0.3F);
}

void frame_border(TexturePainter& painter, float width, Colour colour) {
  const float w = painter.width_m();
  const float h = painter.height_m();
  painter.rectangle({w / 2, 0}, {w, width}, 0, colour);
  painter.rectangle({w / 2, h}, {w, width}, 0, colour);
  painter.rectangle({0, h / 2}, {width, h}, 0, colour);
  painter.rectangle({w, h / 2}, {width, h}, 0, colour);
}

}  // namespace posed
