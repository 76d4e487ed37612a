#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>

#include "drivers/synthetic_furniture.h"
#include "drivers/synthetic_places.h"

namespace posed {

namespace {

constexpr float kHalfLength_m = 3.1F;
constexpr float kHalfWidth_m = 2.6F;
constexpr float kHeight_m = 2.7F;
constexpr float kPicturesTo_m = 2.62F;

void furnish_walls(SceneBuilder& builder, Furnisher& furnisher, const FloorArea& area) {
  std::array<Furniture, 10> pieces{Furniture::Bookshelf, Furniture::Desk,   Furniture::Cabinet,   Furniture::Cartons,
                                   Furniture::LowShelf,  Furniture::Sofa,   Furniture::Bookshelf, Furniture::Desk,
                                   Furniture::Chairs,    Furniture::Cabinet};
  shuffle(pieces, builder.rng());
  constexpr std::array<float, 3> kLongWall{-1.95F, 0.0F, 1.95F};
  constexpr std::array<float, 2> kShortWall{-1.15F, 1.15F};
  const std::array<Place, 4> walls = sides_of(area);
  std::size_t next = 0;
  for (std::size_t i = 0; i < walls.size(); ++i) {
    for (const float x : i % 2 == 0 ? std::span<const float>(kLongWall) : std::span<const float>(kShortWall)) {
      furnisher.furnish_below_pictures(walls[i], x, pieces[next++], kPicturesTo_m);
    }
  }
}

void place_chairs(SceneBuilder& builder, Furnisher& furnisher, int count, float heading_rad) {
  constexpr std::array<float, SyntheticScene::kMaxSeats> kBearing{0.33F, -0.4F, 1.1F, -1.15F, 1.85F, -1.9F, 2.55F, -2.7F};
  for (int i = 0; i < std::min(count, SyntheticScene::kMaxSeats); ++i) {
    const float bearing = heading_rad + kBearing[static_cast<std::size_t>(i)];
    const Eigen::Vector2f position(2.0F * std::cos(bearing), 1.62F * std::sin(bearing));
    const float inward = std::atan2(-position.y(), -position.x()) + builder.rng().uniform(-0.6F, 0.6F);
    builder.add_seat({.position = position, .yaw_rad = inward});
    furnisher.chair({position, inward - std::numbers::pi_v<float> / 2});
  }
}

}  // namespace

SyntheticScene build_room(std::uint32_t seed, int seats, float heading_rad) {
  const FloorArea area{.half = {kHalfLength_m, kHalfWidth_m}};
  SceneBuilder builder(hash32(seed, 0x5ce0eU), {.half_m = area.half, .height_m = kHeight_m});
  Furnisher furnisher(builder);
  furnish_walls(builder, furnisher, area);
  place_chairs(builder, furnisher, seats, heading_rad);
  builder.add_painted_walls(area);
  builder.add_ceiling(area, builder.add_texture(paint_ceiling(2 * kHalfLength_m, 2 * kHalfWidth_m, builder.rng().next())));
  const std::vector<FloorShadow> shadows = builder.shadows_on(area);
  builder.add_floor(area, builder.add_texture(paint_floor(2 * kHalfLength_m, 2 * kHalfWidth_m, shadows, builder.rng().next())));
  return std::move(builder).finish();
}

}  // namespace posed
