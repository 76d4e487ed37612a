#include "drivers/synthetic_world.h"

#include <algorithm>

#include "drivers/synthetic_hash.h"
#include "drivers/synthetic_materials.h"

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

SyntheticWorld::SyntheticWorld(const SyntheticConfig& config)
    : trajectory_(fold_seed(config.seed)),
      scene_(
          build_synthetic_scene(fold_seed(config.seed), chairs_for(config), static_cast<float>(trajectory_.start_heading_rad()))) {
  for (int i = 0; i < people_of(config); ++i) {
    const std::uint32_t seed = hash32(fold_seed(config.seed), 0x9e09e1U, static_cast<std::uint32_t>(i));
    const PersonLook look = dress(seed);
    people_.push_back(config.mode == SyntheticMode::Walking
                          ? SyntheticPerson::walking(seed, i, trajectory_, look)
                          : SyntheticPerson::sitting(seed, scene_.seats[static_cast<std::size_t>(i)], look));
  }
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
