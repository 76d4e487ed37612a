#include "drivers/synthetic_world.h"

#include <algorithm>
#include <utility>

#include "drivers/synthetic_hash.h"
#include "drivers/synthetic_materials.h"
#include "drivers/synthetic_places.h"
#include "drivers/synthetic_walk.h"

namespace posed {

namespace {

std::uint32_t fold_seed(std::int64_t seed) {
  const auto bits = static_cast<std::uint64_t>(seed);
  return hash32(static_cast<std::uint32_t>(bits), static_cast<std::uint32_t>(bits >> 32));
}

int people_of(const SyntheticConfig& config) {
  return std::clamp(config.people, 0, SyntheticWorld::kMaxPeople);
}

/// Those who walk need the floor; those who sit need chairs, and two stay free.
int chairs_for(const SyntheticConfig& config) {
  return config.mode == SyntheticMode::Sitting ? std::min(people_of(config) + 2, SyntheticScene::kMaxSeats) : 0;
}

}  // namespace

std::string_view world_name(SyntheticWorldKind kind) {
  switch (kind) {
    case SyntheticWorldKind::Room: return "room";
    case SyntheticWorldKind::Corridor: return "corridor";
    case SyntheticWorldKind::Office: return "office";
    case SyntheticWorldKind::TwinRooms: return "twin_rooms";
  }
  return "unknown";
}

SyntheticWorld::SyntheticWorld(const SyntheticConfig& config) {
  if (config.world == SyntheticWorldKind::Room) {
    enter_room(config);
  } else {
    walk_through(config.world, fold_seed(config.seed));
  }
}

void SyntheticWorld::enter_room(const SyntheticConfig& config) {
  auto sweep = std::make_unique<SweepTrajectory>(fold_seed(config.seed));
  scene_ = build_room(fold_seed(config.seed), chairs_for(config), static_cast<float>(sweep->start_heading_rad()));
  for (int i = 0; i < people_of(config); ++i) {
    const std::uint32_t seed = hash32(fold_seed(config.seed), 0x9e09e1U, static_cast<std::uint32_t>(i));
    const PersonLook look = dress(seed);
    people_.push_back(config.mode == SyntheticMode::Walking
                          ? SyntheticPerson::walking(seed, i, *sweep, look)
                          : SyntheticPerson::sitting(seed, scene_.seats[static_cast<std::size_t>(i)], look));
  }
  trajectory_ = std::move(sweep);
}

void SyntheticWorld::walk_through(SyntheticWorldKind kind, std::uint32_t seed) {
  WalkedPlace place = kind == SyntheticWorldKind::Corridor ? build_corridor(seed)
                      : kind == SyntheticWorldKind::Office ? build_office(seed)
                                                           : build_twin_rooms(seed);
  scene_ = std::move(place.scene);
  trajectory_ = std::make_unique<WalkTrajectory>(std::move(place.path), seed);
}

PersonLook SyntheticWorld::dress(std::uint32_t seed) {
  const auto add = [this](MipTexture texture) {
    scene_.textures.push_back(std::move(texture));
    return static_cast<std::uint32_t>(scene_.textures.size() - 1);
  };
  // Head and hands of one person have one colour: the same seed.
  return {.shirt = add(paint_shirt(1.1F, 0.7F, hash32(seed, 1))),
          .trousers = add(paint_trousers(0.9F, 0.7F, hash32(seed, 2))),
          .head = add(paint_head(0.6F, 0.26F, hash32(seed, 3))),
          .skin = add(paint_skin(0.4F, 0.3F, hash32(seed, 3))),
          .hair = add(paint_hair(0.64F, 0.24F, hash32(seed, 4))),
          .shoes = add(paint_hair(0.4F, 0.3F, hash32(seed, 5)))};
}

void SyntheticWorld::body_parts(double t_s, std::vector<BodyPart>& parts) const {
  parts.clear();
  for (const SyntheticPerson& person : people_) {
    person.append_parts(t_s, parts);
  }
}

}  // namespace posed
