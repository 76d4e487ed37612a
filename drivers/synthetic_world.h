#pragma once

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "config/config.h"
#include "drivers/synthetic_person.h"
#include "drivers/synthetic_scene.h"
#include "drivers/synthetic_trajectory.h"

namespace posed {

/// The name of a world in the configuration. Reentrant.
std::string_view world_name(SyntheticWorldKind kind);

/// The synthetic world: a furnished place, the people in it, and the way of the camera through it, everything a function of the
/// configuration and of time. World frame: metres, z up, origin in the middle of the floor. Immutable, so thread-safe.
class SyntheticWorld {
 public:
  static constexpr int kMaxPeople = SyntheticScene::kMaxSeats;

  /// `config.people` is clamped to 0..kMaxPeople, and only the room has people; whoever reads a user's values checks them first.
  /// Paints the place: tenths of a second.
  explicit SyntheticWorld(const SyntheticConfig& config);

  const SyntheticScene& scene() const { return scene_; }
  const SyntheticTrajectory& trajectory() const { return *trajectory_; }

  /// T_world_camera at `t_s` >= 0.
  Se3 camera_pose(double t_s) const { return trajectory_->pose(t_s); }

  /// Replaces `parts` by the bodies of all people at `t_s`; does not allocate once `parts` has had its size.
  void body_parts(double t_s, std::vector<BodyPart>& parts) const;

 private:
  void enter_room(const SyntheticConfig& config);
  void walk_through(SyntheticWorldKind kind, std::uint32_t seed);
  PersonLook dress(std::uint32_t seed);

  std::unique_ptr<const SyntheticTrajectory> trajectory_;
  SyntheticScene scene_;
  std::vector<SyntheticPerson> people_;
};

}  // namespace posed
