#include <array>
#include <cstdint>
#include <numbers>
#include <utility>

#include "drivers/synthetic_furniture.h"
#include "drivers/synthetic_places.h"

namespace posed {

namespace {

constexpr float kHeight_m = 2.5F;
constexpr float kPicturesTo_m = 2.42F;
constexpr float kHalfWidth_m = 0.95F;  ///< of the corridor
constexpr double kCorner_m = 0.7;      ///< radius of the way's corners
/// Half the sides of the corridor's middle line; with its corners rounded it is 30 m long.
constexpr double kHalfLong_m = 4.6;
constexpr double kHalfShort_m = 7.5 + kCorner_m * (2 - std::numbers::pi / 2) - kHalfLong_m;

void hang_notice_board(Furnisher& furnisher, HashRng& rng, const Place& wall, float x, float width) {
  const float height = rng.uniform(0.9F, 1.2F);
  furnisher.notice_board(wall, x, rng.uniform(0.8F, 0.95F), width, height);
}

void hang_two_pictures(Furnisher& furnisher, HashRng& rng, const Place& wall, float x, float width) {
  const float low_height = rng.uniform(0.6F, 0.8F);
  furnisher.picture(wall, x, rng.uniform(0.25F, 0.4F), width, low_height);
  const float high_height = rng.uniform(0.7F, 0.95F);
  furnisher.picture(wall, x, rng.uniform(1.3F, 1.4F), width, high_height);
}

/// Furnishes a stretch of `length` metres around the place's x = 0 from one end to the other.
void furnish_stretch(SceneBuilder& builder, Furnisher& furnisher, const Place& wall, float length) {
  enum Kind : std::uint32_t { Door, Standing, NoticeBoard, Pictures };
  constexpr std::array<Furniture, 4> kStanding{Furniture::LowShelf, Furniture::Cartons, Furniture::Cabinet, Furniture::Chairs};
  HashRng& rng = builder.rng();
  std::uint32_t turn = rng.index(4);
  for (float x = -length / 2;;) {
    const auto kind = static_cast<Kind>(turn++ % 4);
    const float width = kind == Door          ? 1.1F
                        : kind == Standing    ? 1.75F
                        : kind == NoticeBoard ? rng.uniform(1.0F, 1.5F)
                                              : rng.uniform(0.6F, 0.9F);
    if (x + width > length / 2) {
      return;
    }
    const float middle = x + width / 2;
    switch (kind) {
      case Door: furnisher.door(wall, middle); break;
      case Standing: furnisher.furnish_below_pictures(wall, middle, kStanding[rng.index(4)], kPicturesTo_m); break;
      case NoticeBoard: hang_notice_board(furnisher, rng, wall, middle, width); break;
      case Pictures: hang_two_pictures(furnisher, rng, wall, middle, width); break;
    }
    x += width + rng.uniform(0.12F, 0.3F);
  }
}

}  // namespace

WalkedPlace build_corridor(std::uint32_t seed) {
  const Eigen::Vector2f middle_line(static_cast<float>(kHalfLong_m), static_cast<float>(kHalfShort_m));
  const FloorArea outer{.half = middle_line + Eigen::Vector2f::Constant(kHalfWidth_m)};
  const FloorArea inner{.half = middle_line - Eigen::Vector2f::Constant(kHalfWidth_m)};
  SceneBuilder builder(hash32(seed, 0xc0221d0U), {.half_m = outer.half, .height_m = kHeight_m});
  Furnisher furnisher(builder);

  const std::array<Place, 4> outer_sides = sides_of(outer);
  const std::array<Place, 4> inner_sides = sides_of(inner);
  for (std::size_t i = 0; i < outer_sides.size(); ++i) {
    const int along = i % 2 == 0 ? 0 : 1;
    // What stands at one wall must leave the corners free for the wall beside it, and for who walks around them.
    furnish_stretch(builder, furnisher, outer_sides[i], 2 * outer.half[along] - 1.2F);
    const Place outwards = inner_sides[i].at(0, 0, std::numbers::pi_v<float>);
    furnish_stretch(builder, furnisher, outwards, 2 * inner.half[along] - 0.4F);
    const Eigen::Vector2f outward = Eigen::Vector2f::Unit(1 - along) * (i == 0 || i == 3 ? -1.0F : 1.0F);
    builder.add_painted_wall(inner.half.cwiseProduct(outward), outward, 2 * inner.half[along]);
  }
  builder.add_painted_walls(outer);
  builder.add_solid_block(inner);
  const Eigen::Vector2f size = 2 * outer.half;
  builder.add_ceiling(outer, builder.add_texture(paint_ceiling(size.x(), size.y(), builder.rng().next())));
  const std::vector<FloorShadow> shadows = builder.shadows_on(outer);
  builder.add_floor(outer, builder.add_texture(paint_vinyl_floor(size.x(), size.y(), shadows, builder.rng().next())));

  const std::array<Eigen::Vector2d, 4> corners{Eigen::Vector2d{-kHalfLong_m, -kHalfShort_m},
                                               {kHalfLong_m, -kHalfShort_m},
                                               {kHalfLong_m, kHalfShort_m},
                                               {-kHalfLong_m, kHalfShort_m}};
  return {.scene = std::move(builder).finish(), .path = RoundedPath(corners, kCorner_m)};
}

}  // namespace posed
