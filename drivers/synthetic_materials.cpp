#include "drivers/synthetic_materials.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/synthetic_hash.h"
#include "drivers/synthetic_motifs.h"
#include "drivers/synthetic_painter.h"

namespace posed {

namespace {

void paint_page(TexturePainter& painter, HashRng& rng) {
  const float w = painter.width_m();
  const float h = painter.height_m();
  painter.fill(from_hue(rng.uniform(), 0.12F, 0.93F));
  const Colour ink = any_colour(rng, 0.8F, 0.05F, 0.3F);
  print_text(painter, rng, {0.06F * w, 0.06F * h}, {0.88F * w, 0.16F * h}, 0.024F * w, ink);
  for (int column = 0; column < 2; ++column) {
    const float left = (0.06F + 0.46F * static_cast<float>(column)) * w;
    float top = 0.26F * h;
    while (top < 0.88F * h) {
      const float height = std::min(rng.uniform(0.12F, 0.3F) * h, 0.95F * h - top);
      if (rng.index(3) == 0) {
        painter.rectangle({left + 0.21F * w, top + height / 2}, {0.21F * w, height * 0.45F}, 0, any_colour(rng, 0.9F, 0.3F, 0.9F));
        for (int i = 0; i < 5; ++i) {
          const float y = top + rng.uniform(0.2F, 0.8F) * height;
          const float x = left + rng.uniform(0.05F, 0.37F) * w;
          const Colour colour = any_colour(rng, 0.9F, 0.05F, 1.0F);
          const float size = rng.uniform(0.04F, 0.12F) * w;
          any_shape(painter, rng, {x, y}, size, colour, 1.0F);
        }
      } else {
        print_text(painter, rng, {left, top}, {0.42F * w, height - 0.02F * h}, 0.0065F + 0.004F * rng.uniform(), ink);
      }
      top += height + 0.01F * h;
    }
  }
}

void paint_mosaic(TexturePainter& painter, HashRng& rng) {
  painter.fill(any_colour(rng, 0.5F, 0.5F, 0.9F));
  const float cell = rng.uniform(0.05F, 0.09F);
  for (float y = cell / 2; y < painter.height_m(); y += cell) {
    for (float x = cell / 2; x < painter.width_m(); x += cell) {
      const Colour colour = any_colour(rng, 0.9F, 0.15F, 1.0F);
      painter.rectangle({x, y}, {cell * 0.46F, cell * 0.46F}, rng.uniform(-0.1F, 0.1F), colour);
      if (rng.index(3) == 0) {
        any_shape(painter, rng, {x, y}, cell * 0.5F, any_colour(rng, 0.9F, 0.05F, 1.0F), 1.0F);
      }
    }
  }
}

void paint_landscape(TexturePainter& painter, HashRng& rng) {
  const float w = painter.width_m();
  const float h = painter.height_m();
  painter.fill(from_hue(0.58F, 0.5F, 0.9F));
  painter.gradient_to(from_hue(0.1F, 0.3F, 0.95F));
  for (int layer = 0; layer < 4; ++layer) {
    const float base = h * (0.35F + 0.15F * static_cast<float>(layer));
    const Colour slope = from_hue(rng.uniform(0.2F, 0.45F), 0.5F, 0.65F - 0.13F * static_cast<float>(layer));
    for (int peak = 0; peak < 7; ++peak) {
      const float x = rng.uniform(0, w);
      const float top = base - rng.uniform(0.05F, 0.25F) * h;
      painter.triangle({x, top}, {x - 0.3F * w, base + 0.3F * h}, {x + 0.3F * w, base + 0.3F * h}, slope * rng.uniform(0.8F, 1.2F));
    }
    painter.rectangle({w / 2, base + h / 2 + 0.2F * h}, {w, h / 2}, 0, slope);
  }
  for (int i = 0; i < 60; ++i) {  // houses with windows
    const float y = rng.uniform(0.55F, 0.97F) * h;
    const Eigen::Vector2f foot(rng.uniform(0, w), y);
    const float size = rng.uniform(0.025F, 0.06F);
    painter.rectangle(foot, {size / 2, size / 2}, 0, any_colour(rng, 0.5F, 0.6F, 1.0F));
    const float roof = rng.uniform(0.3F, 0.7F);
    painter.triangle(foot + Eigen::Vector2f(-0.6F * size, -size / 2), foot + Eigen::Vector2f(0.6F * size, -size / 2),
                     foot + Eigen::Vector2f(0, -1.1F * size), from_hue(rng.uniform(0, 0.08F), 0.7F, roof));
    painter.rectangle(foot, {size / 8, size / 8}, 0, from_hue(0.6F, 0.5F, 0.15F));
  }
}

MipTexture plain(float width_m, float height_m, Colour colour, std::uint32_t seed, float cell_m, float amplitude) {
  TexturePainter painter(width_m, height_m, kFineTexel_m);
  painter.fill(colour);
  painter.mottle(seed, cell_m, cell_m, amplitude, 3);
  return std::move(painter).finish();
}

}  // namespace

MipTexture paint_wall(float width_m, float height_m, std::uint32_t seed) {
  HashRng rng(seed);
  TexturePainter painter(width_m, height_m, kCoarseTexel_m);
  const float hue = rng.uniform();
  painter.fill(from_hue(hue, 0.18F, 0.78F));
  painter.mottle(rng.next(), 0.5F, 0.5F, 0.18F, 5);
  const int stencils = count_for(painter, 45.0F);
  for (int i = 0; i < stencils; ++i) {
    const Eigen::Vector2f centre = any_point(rng, painter);
    const float brightness = rng.uniform(0.25F, 0.95F);
    const float saturation = rng.uniform(0.15F, 0.5F);
    const Colour colour = from_hue(hue + rng.uniform(-0.12F, 0.12F), saturation, brightness);
    const float opacity = rng.uniform(0.4F, 0.9F);
    any_shape(painter, rng, centre, any_size(rng, 0.03F, 0.22F), colour, opacity);
  }
  painter.darken_border(0.5F, 0.3F);
  return std::move(painter).finish();
}

MipTexture paint_poster(float width_m, float height_m, std::uint32_t seed) {
  HashRng rng(seed);
  TexturePainter painter(width_m, height_m, kFineTexel_m);
  switch (rng.index(4)) {
    case 0: paint_page(painter, rng); break;
    case 1: paint_mosaic(painter, rng); break;
    case 2: paint_landscape(painter, rng); break;
    default:
      painter.fill(any_colour(rng, 0.7F, 0.4F, 0.9F));
      scatter(painter, rng, count_for(painter, 60.0F), 0.12F, 0.4F, 0.9F, 0.9F);
      scatter(painter, rng, count_for(painter, 220.0F), 0.02F, 0.12F, 1.0F, 0.9F);
      break;
  }
  painter.mottle(rng.next(), 0.2F, 0.2F, 0.08F, 3);
  frame_border(painter, 0.018F, any_colour(rng, 0.3F, 0.05F, 0.3F));
  return std::move(painter).finish();
}

MipTexture paint_floor(float width_m, float height_m, std::span<const FloorShadow> shadows, std::uint32_t seed) {
  HashRng rng(seed);
  TexturePainter painter(width_m, height_m, kCoarseTexel_m);
  const float hue = rng.uniform();
  painter.fill(from_hue(hue, 0.2F, 0.5F));
  constexpr float kTile_m = 0.25F;
  for (float y = kTile_m / 2; y < height_m + kTile_m; y += kTile_m) {
    for (float x = kTile_m / 2; x < width_m + kTile_m; x += kTile_m) {
      const float shade = rng.uniform(0.38F, 0.62F);
      painter.rectangle({x, y}, {0.48F * kTile_m, 0.48F * kTile_m}, 0, from_hue(hue, 0.25F, shade));
    }
  }
  scatter(painter, rng, count_for(painter, 25.0F), 0.03F, 0.12F, 0.5F, 0.4F);
  const Eigen::Vector2f middle(width_m / 2, height_m / 2);
  const Eigen::Vector2f rug(1.5F, 1.1F);
  painter.rectangle(middle, rug, 0, any_colour(rng, 0.8F, 0.3F, 0.7F));
  for (int i = 0; i < 260; ++i) {
    const float across = rng.uniform(-0.93F, 0.93F);
    const float along = rng.uniform(-0.9F, 0.9F);
    const float size = any_size(rng, 0.05F, 0.2F);
    const Colour colour = any_colour(rng, 0.8F, 0.15F, 0.9F);
    any_shape(painter, rng, middle + Eigen::Vector2f(across * rug.x(), along * rug.y()), size, colour, 0.8F);
  }
  painter.mottle(rng.next(), 0.12F, 0.12F, 0.22F, 4);
  shade_floor(painter, shadows);
  return std::move(painter).finish();
}

MipTexture paint_ceiling(float width_m, float height_m, std::uint32_t seed) {
  HashRng rng(seed);
  TexturePainter painter(width_m, height_m, 0.008F);
  painter.fill({.b = 205, .g = 208, .r = 210});
  constexpr float kPanel_m = 0.6F;
  for (float y = kPanel_m / 2; y < height_m + kPanel_m; y += kPanel_m) {
    for (float x = kPanel_m / 2; x < width_m + kPanel_m; x += kPanel_m) {
      painter.rectangle({x, y}, {0.285F, 0.285F}, 0, Colour{.b = 218, .g = 222, .r = 224} * rng.uniform(0.85F, 1.05F));
    }
  }
  const int spots = count_for(painter, 25.0F);
  for (int i = 0; i < spots; ++i) {
    const Eigen::Vector2f centre = any_point(rng, painter);
    painter.ellipse(centre, Eigen::Vector2f::Constant(any_size(rng, 0.015F, 0.05F)), 0, Colour{90, 95, 100}, 0.8F);
  }
  painter.mottle(rng.next(), 0.3F, 0.3F, 0.08F, 4);
  painter.darken_border(0.6F, 0.35F);
  return std::move(painter).finish();
}

MipTexture paint_cardboard(float width_m, float height_m, std::uint32_t seed) {
  HashRng rng(seed);
  TexturePainter painter(width_m, height_m, kFineTexel_m);
  painter.fill(from_hue(0.09F, 0.42F, 0.68F));
  painter.mottle(rng.next(), 0.3F, 0.02F, 0.14F, 3);
  const int labels = count_for(painter, 22.0F);
  for (int i = 0; i < labels; ++i) {
    const Eigen::Vector2f centre = any_point(rng, painter);
    const float half_height = rng.uniform(0.02F, 0.06F);
    const Eigen::Vector2f half(rng.uniform(0.03F, 0.09F), half_height);
    const bool bare = rng.index(2) == 0;
    if (!bare) {
      painter.rectangle(centre, half + Eigen::Vector2f::Constant(0.01F), 0, any_colour(rng, 0.6F, 0.5F, 1.0F));
    }
    const Colour ink = any_colour(rng, 0.8F, 0.05F, 0.3F);
    print_text(painter, rng, centre - half, 2 * half, rng.uniform(0.004F, 0.011F), ink);
  }
  scatter(painter, rng, count_for(painter, 25.0F), 0.015F, 0.08F, 0.85F, 0.8F);
  return std::move(painter).finish();
}

MipTexture paint_covers(float width_m, float height_m, std::uint32_t seed) {
  HashRng rng(seed);
  TexturePainter painter(width_m, height_m, kFineTexel_m);
  painter.fill({60, 60, 60});
  float x = 0;
  while (x < width_m) {  // bands of covers, so that a narrow window is one book's back
    const float width = rng.uniform(0.05F, 0.09F);
    for (float y = 0; y < height_m;) {
      const float height = rng.uniform(0.2F, 0.4F);
      const Colour cover = any_colour(rng, 0.95F, 0.15F, 0.95F);
      const Colour ink = any_colour(rng, 0.6F, 0.0F, 0.25F);
      const Colour print = cover.g + cover.r > 220 ? ink : from_hue(0.14F, 0.25F, 0.95F);
      painter.rectangle({x + width / 2, y + height / 2}, {width / 2, height / 2}, 0, cover);
      const float half_band = rng.uniform(0.004F, 0.012F);
      painter.rectangle({x + width / 2, y + rng.uniform(0.03F, 0.08F)}, {width / 2, half_band}, 0, print);
      print_text(painter, rng, {x + 0.006F, y + 0.08F}, {width - 0.012F, height - 0.14F}, rng.uniform(0.0035F, 0.007F), print);
      any_shape(painter, rng, {x + width / 2, y + height - 0.04F}, 0.03F, any_colour(rng, 0.9F, 0.1F, 1.0F), 1.0F);
      y += height;
    }
    x += width;
  }
  return std::move(painter).finish();
}

MipTexture paint_wood(float width_m, float height_m, std::uint32_t seed) {
  HashRng rng(seed);
  TexturePainter painter(width_m, height_m, kCoarseTexel_m);
  painter.fill(from_hue(0.075F, 0.5F, 0.62F));
  painter.mottle(rng.next(), 0.8F, 0.03F, 0.35F, 4);
  const int knots = count_for(painter, 30.0F);
  for (int i = 0; i < knots; ++i) {
    const Eigen::Vector2f centre = any_point(rng, painter);
    const float size = any_size(rng, 0.012F, 0.035F);
    painter.ellipse(centre, {1.6F * size, size}, rng.uniform(-0.3F, 0.3F), from_hue(0.06F, 0.6F, 0.28F), 0.85F);
  }
  return std::move(painter).finish();
}

MipTexture paint_upholstery(float width_m, float height_m, std::uint32_t seed) {
  HashRng rng(seed);
  TexturePainter painter(width_m, height_m, 0.004F);
  painter.fill(any_colour(rng, 0.6F, 0.35F, 0.7F));
  painter.mottle(rng.next(), 0.1F, 0.1F, 0.25F, 4);
  scatter(painter, rng, count_for(painter, 110.0F), 0.02F, 0.09F, 0.7F, 0.6F);
  return std::move(painter).finish();
}

MipTexture paint_screen(float width_m, float height_m, std::uint32_t seed) {
  HashRng rng(seed);
  TexturePainter painter(width_m, height_m, 0.002F);
  painter.fill(from_hue(rng.uniform(0.5F, 0.7F), 0.6F, 0.35F));
  for (int i = 0; i < 4; ++i) {
    const float half_height = rng.uniform(0.15F, 0.3F) * height_m;
    const Eigen::Vector2f half(rng.uniform(0.15F, 0.3F) * width_m, half_height);
    const float y = rng.uniform(half.y(), height_m - half.y());
    const Eigen::Vector2f centre(rng.uniform(half.x(), width_m - half.x()), y);
    const bool dark = rng.index(2) == 0;
    painter.rectangle(centre, half, 0, dark ? Colour{40, 36, 34} : Colour{235, 238, 238});
    painter.rectangle(centre - Eigen::Vector2f(0, half.y()), {half.x(), 0.008F}, 0, any_colour(rng, 0.9F, 0.5F, 0.9F));
    print_text(painter, rng, centre - half * 0.9F, half * 1.8F, 0.004F, dark ? Colour{150, 220, 150} : Colour{50, 45, 40});
  }
  frame_border(painter, 0.012F, {25, 25, 25});
  return std::move(painter).finish();
}

MipTexture paint_shirt(float width_m, float height_m, std::uint32_t seed) {
  HashRng rng(seed);
  TexturePainter painter(width_m, height_m, 0.004F);
  painter.fill(any_colour(rng, 1.0F, 0.4F, 0.9F));
  if (rng.index(2) == 0) {
    const Colour stripe = any_colour(rng, 0.9F, 0.2F, 1.0F);
    const float pitch = rng.uniform(0.05F, 0.1F);
    for (float y = 0; y < height_m; y += pitch) {
      painter.rectangle({width_m / 2, y}, {width_m, pitch * 0.2F}, 0, stripe);
    }
  }
  scatter(painter, rng, count_for(painter, 90.0F), 0.02F, 0.08F, 0.9F, 0.9F);
  print_text(painter, rng, {0.4F * width_m, 0.35F * height_m}, {0.2F * width_m, 0.25F * height_m}, 0.014F,
             any_colour(rng, 0.8F, 0.05F, 0.3F));
  painter.mottle(rng.next(), 0.12F, 0.12F, 0.2F, 3);
  return std::move(painter).finish();
}

MipTexture paint_trousers(float width_m, float height_m, std::uint32_t seed) {
  HashRng rng(seed);
  TexturePainter painter(width_m, height_m, 0.004F);
  const float brightness = rng.uniform(0.25F, 0.5F);
  const float saturation = rng.uniform(0.1F, 0.5F);
  painter.fill(from_hue(rng.uniform(0.55F, 0.72F), saturation, brightness));
  painter.mottle(rng.next(), 0.06F, 0.15F, 0.35F, 4);
  return std::move(painter).finish();
}

MipTexture paint_head(float width_m, float height_m, std::uint32_t seed) {
  HashRng rng(seed);
  TexturePainter painter(width_m, height_m, kFineTexel_m);
  const float brightness = rng.uniform(0.5F, 0.9F);
  const Colour skin = from_hue(0.06F, 0.45F, brightness);
  painter.fill(skin);
  painter.mottle(rng.next(), 0.08F, 0.08F, 0.12F, 2);
  const float x = width_m / 2;
  for (const float side : {-1.0F, 1.0F}) {
    const Eigen::Vector2f eye(x + side * 0.045F, 0.45F * height_m);
    painter.ellipse(eye, {0.02F, 0.011F}, 0, {235, 240, 240});
    painter.ellipse(eye, {0.009F, 0.01F}, 0, {50, 35, 25});
    painter.rectangle(eye - Eigen::Vector2f(0, 0.025F), {0.024F, 0.005F}, 0, skin * 0.35F);
  }
  painter.triangle({x, 0.5F * height_m}, {x - 0.016F, 0.64F * height_m}, {x + 0.016F, 0.64F * height_m}, skin * 0.75F);
  painter.ellipse({x, 0.76F * height_m}, {0.032F, 0.009F}, 0, Colour{90, 80, 170} * brightness);
  return std::move(painter).finish();
}

MipTexture paint_skin(float width_m, float height_m, std::uint32_t seed) {
  HashRng rng(seed);
  const std::uint32_t mottle_seed = rng.next();
  return plain(width_m, height_m, from_hue(0.06F, 0.45F, rng.uniform(0.5F, 0.9F)), mottle_seed, 0.08F, 0.12F);
}

MipTexture paint_hair(float width_m, float height_m, std::uint32_t seed) {
  HashRng rng(seed);
  const float grey = rng.uniform(0.08F, 0.5F);
  return plain(width_m, height_m, from_hue(0.08F, 0.5F, grey), rng.next(), 0.03F, 0.5F);
}

}  // namespace posed
