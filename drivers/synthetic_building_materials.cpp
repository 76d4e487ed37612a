#include <algorithm>
#include <utility>

#include "drivers/synthetic_materials.h"
#include "drivers/synthetic_motifs.h"

namespace posed {

namespace {

/// A sheet of paper with a heading, script and sometimes a drawing; `size` in metres, upright.
void pin_page(TexturePainter& painter, HashRng& rng, Eigen::Vector2f centre, Eigen::Vector2f size) {
  const Eigen::Vector2f half = size / 2;
  const bool coloured = rng.index(4) == 0;
  const Colour paper = coloured ? any_colour(rng, 0.6F, 0.7F, 1.0F) : Colour{.b = 225, .g = 235, .r = 238};
  const Colour ink = any_colour(rng, 0.7F, 0.05F, 0.3F);
  const float angle = rng.uniform(-0.05F, 0.05F);
  painter.shadow(centre + Eigen::Vector2f::Constant(0.006F), half, angle, 0.012F, 0.4F);
  painter.rectangle(centre, half, angle, paper);
  const Eigen::Vector2f origin = centre - 0.86F * half;
  print_text(painter, rng, origin, {1.72F * half.x(), 0.3F * half.y()}, rng.uniform(0.008F, 0.013F), ink);
  const bool drawing = rng.index(3) == 0;
  const Eigen::Vector2f body = origin + Eigen::Vector2f(0, 0.4F * half.y());
  if (drawing) {
    for (int i = 0; i < 6; ++i) {
      const float x = rng.uniform(0.2F, 1.5F) * half.x();
      const float y = rng.uniform(0.15F, 1.15F) * half.y();
      const Colour colour = any_colour(rng, 0.9F, 0.1F, 0.9F);
      any_shape(painter, rng, body + Eigen::Vector2f(x, y), rng.uniform(0.03F, 0.07F), colour, 1.0F);
    }
  } else {
    print_text(painter, rng, body, {1.72F * half.x(), 1.3F * half.y()}, 0.005F, ink);
  }
  painter.ellipse(centre - Eigen::Vector2f(0, 0.9F * half.y()), {0.007F, 0.007F}, 0, any_colour(rng, 1.0F, 0.5F, 1.0F));
}

}  // namespace

MipTexture paint_vinyl_floor(float width_m, float height_m, std::span<const FloorShadow> shadows, std::uint32_t seed) {
  HashRng rng(seed);
  TexturePainter painter(width_m, height_m, 0.006F);
  const float hue = rng.uniform();
  painter.fill(from_hue(hue, 0.15F, 0.55F));
  constexpr float kSheet_m = 0.6F;
  for (float y = kSheet_m / 2; y < height_m + kSheet_m; y += kSheet_m) {
    for (float x = kSheet_m / 2; x < width_m + kSheet_m; x += kSheet_m) {
      const bool dark = rng.index(5) == 0;
      const float shade = dark ? rng.uniform(0.3F, 0.4F) : rng.uniform(0.5F, 0.66F);
      painter.rectangle({x, y}, Eigen::Vector2f::Constant(0.495F * kSheet_m), 0, from_hue(hue, 0.18F, shade));
    }
  }
  painter.mottle(rng.next(), 0.15F, 0.15F, 0.2F, 4);
  const int speckles = count_for(painter, 60.0F);
  for (int i = 0; i < speckles; ++i) {
    const Eigen::Vector2f centre = any_point(rng, painter);
    const float brightness = rng.uniform(0.15F, 0.95F);
    const float size = any_size(rng, 0.025F, 0.11F);
    const float opacity = rng.uniform(0.35F, 0.85F);
    any_shape(painter, rng, centre, size, from_hue(hue + 0.05F, 0.2F, brightness), opacity);
  }
  shade_floor(painter, shadows);
  return std::move(painter).finish();
}

MipTexture paint_door(float width_m, float height_m, std::uint32_t seed) {
  HashRng rng(seed);
  TexturePainter painter(width_m, height_m, kFineTexel_m);
  const Colour leaf = any_colour(rng, 0.55F, 0.4F, 0.75F);
  painter.fill(leaf);
  const bool wooden = rng.index(2) == 0;
  painter.mottle(rng.next(), wooden ? 0.03F : 0.2F, wooden ? 0.7F : 0.2F, wooden ? 0.3F : 0.1F, 4);
  const float middle = width_m / 2;
  const bool pane = rng.index(3) == 0;
  if (pane) {
    painter.rectangle({middle, 0.3F * height_m}, {0.28F * width_m, 0.19F * height_m}, 0, leaf * 0.4F);
    painter.rectangle({middle, 0.3F * height_m}, {0.26F * width_m, 0.18F * height_m}, 0, any_colour(rng, 0.3F, 0.55F, 0.9F));
    for (int i = 0; i < 9; ++i) {
      const float x = middle + rng.uniform(-0.2F, 0.2F) * width_m;
      const float y = rng.uniform(0.17F, 0.43F) * height_m;
      const float size = rng.uniform(0.05F, 0.13F);
      any_shape(painter, rng, {x, y}, size, any_colour(rng, 0.4F, 0.15F, 0.8F), 0.7F);
    }
  }
  for (const float y : {pane ? 0.66F : 0.28F, 0.78F}) {  // raised panels
    const Eigen::Vector2f half(0.36F * width_m, y < 0.5F ? 0.16F * height_m : 0.13F * height_m);
    painter.rectangle({middle, y * height_m}, half, 0, leaf * 0.55F, 0.8F);
    painter.rectangle({middle, y * height_m}, half - Eigen::Vector2f::Constant(0.02F), 0, leaf * 1.15F, 0.85F);
  }
  const Colour plate{.b = 60, .g = 55, .r = 50};
  painter.rectangle({middle, 0.085F * height_m}, {0.19F, 0.055F}, 0, {.b = 230, .g = 235, .r = 235});
  print_text(painter, rng, {middle - 0.17F, 0.085F * height_m - 0.045F}, {0.34F, 0.09F}, 0.009F, plate);
  const float handle = rng.index(2) == 0 ? 0.09F : 0.91F;
  painter.rectangle({handle * width_m, 0.51F * height_m}, {0.022F, 0.11F}, 0, {.b = 200, .g = 205, .r = 205});
  painter.ellipse({handle * width_m, 0.53F * height_m}, {0.01F, 0.014F}, 0, plate);
  painter.rectangle({middle, 0.49F * height_m}, {0.055F, 0.012F}, 0, plate);
  const int notes = 1 + static_cast<int>(rng.index(3));
  for (int i = 0; i < notes; ++i) {
    const float y = rng.uniform(0.2F, 0.6F) * height_m;
    const float x = rng.uniform(0.3F, 0.7F) * width_m;
    pin_page(painter, rng, {x, y}, {0.21F, 0.29F});
  }
  frame_border(painter, 0.012F, leaf * 0.4F);
  return std::move(painter).finish();
}

MipTexture paint_notice_board(float width_m, float height_m, std::uint32_t seed) {
  HashRng rng(seed);
  TexturePainter painter(width_m, height_m, kFineTexel_m);
  painter.fill(from_hue(0.085F, 0.45F, 0.6F));
  painter.mottle(rng.next(), 0.02F, 0.02F, 0.2F, 3);
  constexpr float kPitch_x_m = 0.26F;
  constexpr float kPitch_y_m = 0.33F;
  for (float y = kPitch_y_m / 2 + 0.02F; y + 0.12F < height_m; y += kPitch_y_m) {
    for (float x = kPitch_x_m / 2 + 0.02F; x + 0.1F < width_m; x += kPitch_x_m) {
      if (rng.index(6) == 0) {
        continue;
      }
      const float width = rng.uniform(0.13F, 0.23F);
      const float height = rng.uniform(0.16F, 0.3F);
      const float down = rng.uniform(-0.02F, 0.02F);
      const float across = rng.uniform(-0.02F, 0.02F);
      pin_page(painter, rng, {x + across, y + down}, {width, height});
    }
  }
  frame_border(painter, 0.02F, from_hue(0.08F, 0.5F, 0.35F));
  return std::move(painter).finish();
}

}  // namespace posed
