#include "drivers/synthetic_furniture.h"

#include <algorithm>
#include <numbers>
#include <utility>

#include "drivers/synthetic_materials.h"

namespace posed {

namespace {

constexpr float kBoard_m = 0.02F;  ///< thickness of what hangs on a wall
constexpr float kGap_m = 0.002F;   ///< from a surface to the panel that lies on it
constexpr float kDoorWidth_m = 0.95F;
constexpr float kDoorHeight_m = 2.05F;

}  // namespace

void shuffle(std::span<Furniture> pieces, HashRng& rng) {
  for (std::size_t i = pieces.size() - 1; i > 0; --i) {
    std::swap(pieces[i], pieces[rng.index(static_cast<std::uint32_t>(i + 1))]);
  }
}

Furnisher::Furnisher(SceneBuilder& builder)
    : builder_(builder),
      rng_(builder.rng()),
      wood_(builder.add_texture(paint_wood(2.4F, 2.0F, rng_.next()))),
      cardboard_(builder.add_texture(paint_cardboard(1.6F, 1.2F, rng_.next()))),
      covers_(builder.add_texture(paint_covers(2.0F, 1.2F, rng_.next()))),
      upholstery_(builder.add_texture(paint_upholstery(2.0F, 1.2F, rng_.next()))),
      metal_(builder.add_texture(paint_trousers(0.6F, 0.9F, rng_.next()))) {}

void Furnisher::board(const Place& wall, float x, float z, Eigen::Vector2f size) {
  builder_.add_box(wall, {.base = {x, kBoard_m / 2, z}, .size = {size.x(), kBoard_m, size.y()}, .texture = metal_});
}

void Furnisher::picture(const Place& wall, float x, float z, float width, float height) {
  board(wall, x, z, {width, height});
  const std::uint32_t texture = builder_.add_texture(paint_poster(width, height, rng_.next()));
  builder_.add_panel(wall, {.head = {x, kBoard_m + kGap_m, z + height}, .size = {width, height}}, texture);
}

void Furnisher::notice_board(const Place& wall, float x, float z, float width, float height) {
  board(wall, x, z, {width, height});
  const std::uint32_t texture = builder_.add_texture(paint_notice_board(width, height, rng_.next()));
  builder_.add_panel(wall, {.head = {x, kBoard_m + kGap_m, z + height}, .size = {width, height}}, texture);
}

void Furnisher::door(const Place& wall, float x) {
  constexpr float kFrame_m = 0.06F;
  const std::uint32_t texture = builder_.add_texture(paint_door(kDoorWidth_m, kDoorHeight_m, rng_.next()));
  builder_.add_panel(wall, {.head = {x, kGap_m, kDoorHeight_m}, .size = {kDoorWidth_m, kDoorHeight_m}}, texture);
  for (const float side : {-1.0F, 1.0F}) {
    const float post = x + side * (kDoorWidth_m + kFrame_m) / 2;
    builder_.add_box(wall, {.base = {post, kFrame_m / 2, 0}, .size = {kFrame_m, kFrame_m, kDoorHeight_m}, .texture = metal_});
  }
  const Eigen::Vector3f lintel(kDoorWidth_m + 2 * kFrame_m, kFrame_m, kFrame_m);
  builder_.add_box(wall, {.base = {x, kFrame_m / 2, kDoorHeight_m}, .size = lintel, .texture = metal_});
}

void Furnisher::partition(const Place& place, float width, float height) {
  constexpr float kThickness_m = 0.06F;
  builder_.add_box(place, {.base = {0, 0, 0}, .size = {width, kThickness_m, height}, .texture = upholstery_});
  for (const float turn : {0.0F, std::numbers::pi_v<float>}) {
    const Place side = place.at(0, 0, turn).at(0, kThickness_m / 2);
    for (const float x : {-0.26F, 0.26F}) {
      const float paper = rng_.uniform(0.3F, 0.42F) * width;
      const float tall = std::min(rng_.uniform(0.36F, 0.5F), height - 0.85F);
      const float head = height - rng_.uniform(0.04F, 0.1F);
      const std::uint32_t texture = builder_.add_texture(paint_poster(paper, tall, rng_.next()));
      builder_.add_panel(side, {.head = {x * width, kGap_m, head}, .size = {paper, tall}}, texture);
    }
  }
}

void Furnisher::pile(const Place& place, float z, float width, float depth, int levels) {
  for (int i = 0; i < levels; ++i) {
    const float height = rng_.uniform(0.12F, 0.3F);
    const float w = width * rng_.uniform(0.65F, 1.0F);
    const float d = depth * rng_.uniform(0.65F, 0.9F);
    builder_.add_box(place,
                     {.base = {0, 0, z}, .size = {w, d, height}, .texture = cardboard_, .turn_rad = rng_.uniform(-0.12F, 0.12F)});
    z += height;
  }
}

void Furnisher::bookshelf(const Place& slot, float width, float height, int rows) {
  constexpr float kDepth_m = 0.34F;
  constexpr float kPlank_m = 0.03F;
  const float pitch = (height - kPlank_m) / static_cast<float>(rows);
  builder_.add_box(slot, {.base = {0, 0.01F, 0}, .size = {width, 0.02F, height}, .texture = wood_});
  for (const float side : {-1.0F, 1.0F}) {
    const float x = side * (width - kPlank_m) / 2;
    builder_.add_box(slot, {.base = {x, kDepth_m / 2, 0}, .size = {kPlank_m, kDepth_m, height}, .texture = wood_});
  }
  for (int row = 0; row <= rows; ++row) {
    const float z = pitch * static_cast<float>(row);
    builder_.add_box(slot, {.base = {0, kDepth_m / 2, z}, .size = {width - 2 * kPlank_m, kDepth_m, kPlank_m}, .texture = wood_});
    if (row == rows) {
      break;
    }
    float x = -width / 2 + kPlank_m + 0.005F;
    while (x < width / 2 - 0.11F) {
      if (rng_.index(8) == 0) {
        x += rng_.uniform(0.08F, 0.2F);
        continue;
      }
      const float thickness = rng_.uniform(0.05F, 0.085F);
      const float tall = std::min(rng_.uniform(0.2F, 0.33F), pitch - 0.05F);
      const float deep = rng_.uniform(0.18F, 0.28F);
      builder_.add_box(
          slot, {.base = {x + thickness / 2, 0.02F + deep / 2, z + kPlank_m}, .size = {thickness, deep, tall}, .texture = covers_});
      x += thickness + 0.002F;
    }
  }
}

void Furnisher::desk(const Place& slot) {
  constexpr float kTop_m = 0.74F;
  builder_.add_box(slot, {.base = {0, 0.25F, kTop_m - 0.04F}, .size = {1.7F, 0.5F, 0.04F}, .texture = wood_});
  for (const float side : {-1.0F, 1.0F}) {
    builder_.add_box(slot, {.base = {side * 0.8F, 0.25F, 0}, .size = {0.05F, 0.46F, kTop_m - 0.04F}, .texture = metal_});
  }
  builder_.add_box(slot, {.base = {0.5F, 0.24F, 0}, .size = {0.4F, 0.42F, 0.55F}, .texture = cardboard_});
  const float x = rng_.uniform(-0.3F, 0.1F);
  builder_.add_box(slot, {.base = {x, 0.16F, kTop_m}, .size = {0.2F, 0.16F, 0.1F}, .texture = metal_});
  builder_.add_box(slot, {.base = {x, 0.16F, kTop_m + 0.1F}, .size = {0.56F, 0.05F, 0.36F}, .texture = metal_});
  const std::uint32_t screen = builder_.add_texture(paint_screen(0.54F, 0.34F, rng_.next()));
  builder_.add_panel(slot, {.head = {x, 0.188F, kTop_m + 0.45F}, .size = {0.54F, 0.34F}}, screen);
  pile(slot.at(0.62F, 0.24F), kTop_m, 0.36F, 0.36F, 1);
  for (int i = 0; i < 4; ++i) {
    const float lateral = rng_.uniform(-0.75F, 0.4F);
    const float forward = rng_.uniform(0.3F, 0.4F);
    const float thickness = rng_.uniform(0.02F, 0.07F);
    const float turn = rng_.uniform(-0.6F, 0.6F);
    builder_.add_box(slot,
                     {.base = {lateral, forward, kTop_m}, .size = {0.2F, 0.14F, thickness}, .texture = covers_, .turn_rad = turn});
  }
}

void Furnisher::cabinet(const Place& slot, float width) {
  const float height = rng_.uniform(0.85F, 1.1F);
  builder_.add_box(slot, {.base = {0, 0.21F, 0}, .size = {width, 0.42F, height}, .texture = wood_});
  const int drawers = 3;
  for (int i = 0; i < 2 * drawers; ++i) {
    const float x = (i % 2 == 0 ? -0.25F : 0.25F) * width;
    const float z = 0.05F + (height - 0.08F) / drawers * static_cast<float>(i / 2);
    const Eigen::Vector3f size(width * 0.46F, 0.02F, (height - 0.08F) / drawers - 0.03F);
    builder_.add_box(slot, {.base = {x, 0.43F, z}, .size = size, .texture = i % 3 == 1 ? upholstery_ : wood_});
    builder_.add_box(slot, {.base = {x, 0.445F, z + size.z() / 2}, .size = {0.12F, 0.02F, 0.025F}, .texture = metal_});
  }
  pile(slot.at(-0.25F * width, 0.21F), height, 0.42F, 0.36F, 2);
  pile(slot.at(0.25F * width, 0.21F), height, 0.4F, 0.34F, 1);
}

void Furnisher::cartons(const Place& slot) {
  for (const float x : {-0.52F, 0.0F, 0.52F}) {
    const int levels = 2 + static_cast<int>(rng_.index(4));
    pile(slot.at(x, 0.25F, rng_.uniform(-0.08F, 0.08F)), 0, 0.46F, 0.44F, levels);
  }
}

void Furnisher::sofa(const Place& slot) {
  builder_.add_box(slot, {.base = {0, 0.25F, 0.08F}, .size = {1.7F, 0.48F, 0.34F}, .texture = upholstery_});
  builder_.add_box(slot, {.base = {0, 0.08F, 0.42F}, .size = {1.7F, 0.16F, 0.42F}, .texture = upholstery_});
  for (const float side : {-1.0F, 1.0F}) {
    builder_.add_box(slot, {.base = {side * 0.78F, 0.25F, 0.42F}, .size = {0.14F, 0.48F, 0.18F}, .texture = upholstery_});
    const float x = side * rng_.uniform(0.25F, 0.45F);
    builder_.add_box(slot, {.base = {x, 0.25F, 0.42F}, .size = {0.36F, 0.12F, 0.3F}, .texture = covers_, .turn_rad = side * 0.3F});
  }
}

void Furnisher::chair(const Place& place) {
  constexpr float kSeat_m = SyntheticScene::kSeatHeight_m;
  builder_.add_box(place, {.base = {0, 0, kSeat_m - 0.05F}, .size = {0.42F, 0.42F, 0.05F}, .texture = upholstery_});
  builder_.add_box(place, {.base = {0, -0.2F, kSeat_m + 0.1F}, .size = {0.4F, 0.03F, 0.32F}, .texture = upholstery_});
  for (const float side : {-1.0F, 1.0F}) {
    builder_.add_box(place, {.base = {side * 0.19F, 0.19F, 0}, .size = {0.035F, 0.035F, kSeat_m - 0.05F}, .texture = metal_});
    builder_.add_box(place, {.base = {side * 0.19F, -0.2F, 0}, .size = {0.035F, 0.035F, kSeat_m + 0.1F}, .texture = metal_});
  }
}

float Furnisher::furnish(const Place& slot, Furniture kind) {
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

void Furnisher::furnish_below_pictures(const Place& wall, float x, Furniture kind, float pictures_to_m) {
  const float top = furnish(wall.at(x, 0), kind) + rng_.uniform(0.05F, 0.1F);
  const float room = pictures_to_m - top;
  if (room < 0.7F) {
    picture(wall, x, top, rng_.uniform(0.9F, 1.4F), room);
    return;
  }
  for (const float side : {-1.0F, 1.0F}) {
    const float height = rng_.uniform(0.75F, 1.0F) * room;
    const float width = rng_.uniform(0.6F, 0.78F);
    const float bottom = top + rng_.uniform() * (room - height);
    picture(wall, x + side * 0.43F, bottom, width, height);
  }
}

}  // namespace posed
