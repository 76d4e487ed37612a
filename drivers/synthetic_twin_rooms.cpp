#include <array>
#include <numbers>
#include <utility>

#include "drivers/synthetic_furniture.h"
#include "drivers/synthetic_places.h"

namespace posed {

namespace {

constexpr float kHeight_m = 2.5F;
constexpr float kPicturesTo_m = 2.42F;
constexpr float kHalfRoom_m = 2.25F;
constexpr float kHalfPassage_m = 2.0F;        ///< of the corridor's length
constexpr float kHalfPassageWidth_m = 0.75F;  ///< of its width, which is the doorway's, too
constexpr float kMiddle_m = kHalfPassage_m + kHalfRoom_m;

/// The western room, open towards the corridor in the middle of its eastern side.
void build_western_room(SceneBuilder& builder) {
  const FloorArea room{.centre = {-kMiddle_m, 0}, .half = {kHalfRoom_m, kHalfRoom_m}};
  Furnisher furnisher(builder);
  std::array<Furniture, 6> pieces{Furniture::Bookshelf, Furniture::Desk, Furniture::Cabinet,
                                  Furniture::Cartons,   Furniture::Sofa, Furniture::LowShelf};
  shuffle(pieces, builder.rng());
  const auto [south, east, north, west] = sides_of(room);
  std::size_t next = 0;
  for (const Place& side : {south, north, west}) {
    for (const float x : {-0.88F, 0.88F}) {
      furnisher.furnish_below_pictures(side, x, pieces[next++], kPicturesTo_m);
    }
  }
  constexpr float kPier_m = kHalfRoom_m - kHalfPassageWidth_m;  // the wall on either side of the doorway
  constexpr float kPierMiddle_m = kHalfPassageWidth_m + kPier_m / 2;
  for (const float side : {-1.0F, 1.0F}) {
    furnisher.picture(east, side * kPierMiddle_m, 1.25F, 1.2F, 1.1F);
    furnisher.picture(east, side * kPierMiddle_m, 0.3F, 1.0F, 0.8F);
    builder.add_painted_wall({-kHalfPassage_m, side * kPierMiddle_m}, {-1, 0}, kPier_m);
  }
  for (const float side : {-1.0F, 1.0F}) {
    builder.add_painted_wall({-kMiddle_m, side * kHalfRoom_m}, {0, -side}, 2 * kHalfRoom_m);
  }
  builder.add_painted_wall(west.origin, {1, 0}, 2 * kHalfRoom_m);
  const Eigen::Vector2f size = 2 * room.half;
  builder.add_ceiling(room, builder.add_texture(paint_ceiling(size.x(), size.y(), builder.rng().next())));
  const std::vector<FloorShadow> shadows = builder.shadows_on(room);
  builder.add_floor(room, builder.add_texture(paint_floor(size.x(), size.y(), shadows, builder.rng().next())));
}

void build_passage(SceneBuilder& builder) {
  const FloorArea passage{.half = {kHalfPassage_m, kHalfPassageWidth_m}};
  Furnisher furnisher(builder);
  const auto [south, east, north, west] = sides_of(passage);
  furnisher.door(south, -1.2F);
  furnisher.notice_board(south, 0.6F, 0.85F, 1.6F, 1.2F);
  furnisher.picture(north, -1.0F, 0.9F, 1.3F, 1.2F);
  furnisher.notice_board(north, 0.4F, 1.2F, 0.9F, 1.0F);
  furnisher.picture(north, 1.4F, 0.5F, 0.7F, 1.6F);
  for (const float side : {-1.0F, 1.0F}) {
    builder.add_painted_wall({0, side * kHalfPassageWidth_m}, {0, -side}, 2 * kHalfPassage_m);
    const float half_depth = (kHalfRoom_m - kHalfPassageWidth_m) / 2;
    builder.add_solid_block({.centre = {0, side * (kHalfPassageWidth_m + half_depth)}, .half = {kHalfPassage_m, half_depth}});
  }
  const Eigen::Vector2f size = 2 * passage.half;
  builder.add_ceiling(passage, builder.add_texture(paint_ceiling(size.x(), size.y(), builder.rng().next())));
  builder.add_floor(passage, builder.add_texture(paint_vinyl_floor(size.x(), size.y(), {}, builder.rng().next())));
}

/// Once around the western room, through the corridor, once around the eastern room the same way, and back.
RoundedPath way_through() {
  constexpr double kNear_m = 3.2;  // from the world's origin
  constexpr double kFar_m = 5.2;
  constexpr double kCorner_m = 0.45;
  std::array<Eigen::Vector2d, 12> corners{
      Eigen::Vector2d{-kFar_m, 1}, {-kFar_m, -1}, {-kNear_m, -1}, {-kNear_m, 0}, {kNear_m, 0}, {kNear_m, -1}};
  for (std::size_t i = 6; i < corners.size(); ++i) {
    corners[i] = -corners[i - 6];
  }
  return RoundedPath(corners, kCorner_m);
}

}  // namespace

WalkedPlace build_twin_rooms(std::uint32_t seed) {
  SceneBuilder builder(hash32(seed, 0x7314U), {.half_m = {kMiddle_m + kHalfRoom_m, kHalfRoom_m}, .height_m = kHeight_m});
  build_western_room(builder);
  builder.repeat_half_turned();
  build_passage(builder);
  return {.scene = std::move(builder).finish(), .path = way_through()};
}

}  // namespace posed
