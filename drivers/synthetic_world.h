#pragma once

#include <cstdint>
#include <vector>

#include "config/config.h"
#include "drivers/synthetic_person.h"
#include "drivers/synthetic_scene.h"
#include "drivers/synthetic_trajectory.h"

namespace posed {

/// The synthetic world: a furnished room, its people, and the path of the camera in it, everything a function of the configuration
/// and of time. World frame: metres, z up, origin in the middle of the floor. Immutable, so thread-safe.
class SyntheticWorld {
 public:
  static constexpr int kMaxPeople = SyntheticScene::kMaxSeats;

  /// `config.people` is clamped to 0..kMaxPeople; whoever reads a user's value checks it first.
  explicit SyntheticWorld(const SyntheticConfig& config);

  const SyntheticScene& scene() const { return scene_; }

  /// T_world_camera at `t_s` >= 0.
  Se3 camera_pose(double t_s) const { return trajectory_.pose(t_s); }

  /// Replaces `parts` by the bodies of all people at `t_s`; does not allocate once `parts` has had its size.
  void body_parts(double t_s, std::vector<BodyPart>& parts) const;

 private:
  PersonLook dress(std::uint32_t seed);

  SyntheticTrajectory trajectory_;
  SyntheticScene scene_;
  std::vector<SyntheticPerson> people_;
};

}  // namespace posed
