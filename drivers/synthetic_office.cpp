#include <array>
#include <numbers>
#include <span>
#include <utility>

#include "drivers/synthetic_furniture.h"
#include "drivers/synthetic_places.h"

namespace posed {

namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kHalfLength_m = 5.0F;
constexpr float kHalfWidth_m = 4.0F;
constexpr float kHeight_m = 2.6F;
constexpr float kPicturesTo_m = 2.5F;
/// The aisles lie at x = 0 and +-this, y = 0 and +-that; the groups of desks in the middle between them.
constexpr double kAisle_x_m = 3.0;
constexpr double kAisle_y_m = 2.2;
constexpr double kCorner_m = 0.6;

/// Two desks back to back, a partition between them and one across their one end.
void place_desk_group(Furnisher& furnisher, const Place& middle) {
  constexpr float kPartition_m = 1.5F;
  constexpr float kHalfThickness_m = 0.03F;
  furnisher.partition(middle, 1.76F, kPartition_m);
  furnisher.desk(middle.at(0, kHalfThickness_m));
  furnisher.desk(middle.at(0, -kHalfThickness_m, kPi));
  furnisher.partition(middle.at(0.92F, 0, kPi / 2), 1.06F, kPartition_m);
}

void furnish_walls(SceneBuilder& builder, Furnisher& furnisher, const FloorArea& area) {
  std::array<Furniture, 16> pieces{Furniture::Bookshelf, Furniture::Cabinet,   Furniture::Cartons, Furniture::LowShelf,
                                   Furniture::Sofa,      Furniture::Bookshelf, Furniture::Chairs,  Furniture::Cabinet,
                                   Furniture::Cartons,   Furniture::LowShelf,  Furniture::Cabinet, Furniture::Desk,
                                   Furniture::Cartons,   Furniture::Chairs,    Furniture::Sofa,    Furniture::Cabinet};
  shuffle(pieces, builder.rng());
  constexpr std::array<float, 5> kLongWall{-3.7F, -1.85F, 0.0F, 1.85F, 3.7F};
  constexpr std::array<float, 3> kShortWall{-2.1F, 0.0F, 2.1F};
  const std::array<Place, 4> walls = sides_of(area);
  std::size_t next = 0;
  for (std::size_t i = 0; i < walls.size(); ++i) {
    for (const float x : i % 2 == 0 ? std::span<const float>(kLongWall) : std::span<const float>(kShortWall)) {
      furnisher.furnish_below_pictures(walls[i], x, pieces[next++], kPicturesTo_m);
    }
  }
}

/// Around three of the four groups of desks, each leg along an aisle: the eastern half of the middle aisle is walked in both
/// directions, the northern half of the cross aisle twice southwards, and the middle crossing is met three times.
RoundedPath way_through() {
  constexpr double kX = kAisle_x_m;
  constexpr double kY = kAisle_y_m;
  const std::array<Eigen::Vector2d, 10> corners{
      Eigen::Vector2d{kX, 0}, {kX, kY}, {0, kY}, {0, -kY}, {kX, -kY}, {kX, 0}, {-kX, 0}, {-kX, kY}, {0, kY}, {0, 0}};
  return RoundedPath(corners, kCorner_m);
}

}  // namespace

WalkedPlace build_office(std::uint32_t seed) {
  const FloorArea area{.half = {kHalfLength_m, kHalfWidth_m}};
  SceneBuilder builder(hash32(seed, 0x0ff1ceU), {.half_m = area.half, .height_m = kHeight_m});
  Furnisher furnisher(builder);
  furnish_walls(builder, furnisher, area);
  for (const float x : {-0.5F, 0.5F}) {
    for (const float y : {-0.5F, 0.5F}) {
      const Eigen::Vector2f middle(x * static_cast<float>(kAisle_x_m), y * static_cast<float>(kAisle_y_m));
      place_desk_group(furnisher, {middle, x < 0 ? kPi : 0.0F});
    }
  }
  builder.add_painted_walls(area);
  builder.add_ceiling(area, builder.add_texture(paint_ceiling(2 * kHalfLength_m, 2 * kHalfWidth_m, builder.rng().next())));
  const std::vector<FloorShadow> shadows = builder.shadows_on(area);
  builder.add_floor(area,
                    builder.add_texture(paint_vinyl_floor(2 * kHalfLength_m, 2 * kHalfWidth_m, shadows, builder.rng().next())));
  return {.scene = std::move(builder).finish(), .path = way_through()};
}

}  // namespace posed
