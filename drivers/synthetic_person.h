#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "config/config.h"
#include "drivers/synthetic_scene.h"
#include "drivers/synthetic_trajectory.h"

namespace posed {

/// A piece of a body: the convex hull of two spheres ("rounded cone"), squeezed along its local x and y. Local z runs from the
/// first sphere's centre to the second's, x points to the piece's front. World frame, metres.
struct BodyPart {
  Eigen::Matrix3f R_world_part = Eigen::Matrix3f::Identity();
  Eigen::Vector3f base{0, 0, 0};  ///< centre of the first sphere
  Eigen::Vector2f squeeze{1, 1};  ///< factors of the local x and y
  float length_m = 0;             ///< between the centres
  float base_radius_m = 0;
  float tip_radius_m = 0;
  std::uint32_t texture = 0;

  float bounding_radius_m() const { return std::max(base_radius_m, tip_radius_m) * std::max({squeeze.x(), squeeze.y(), 1.0F}); }
  Eigen::Vector3f tip() const { return base + R_world_part.col(2) * length_m; }
};

/// Textures of one person, as indices into the scene's.
struct PersonLook {
  std::uint32_t shirt = 0;
  std::uint32_t trousers = 0;
  std::uint32_t head = 0;
  std::uint32_t skin = 0;
  std::uint32_t hair = 0;
  std::uint32_t shoes = 0;
};

/// One person whose posture is a function of time alone. Walking: to and fro on a slim closed loop around the room's middle that
/// drifts with the camera's sweep, so that the person keeps crossing the view; steps follow the way made good. Sitting: on a chair,
/// with arms, head and torso moving a little. Immutable, so thread-safe.
class SyntheticPerson {
 public:
  static constexpr int kParts = 17;

  /// The `index`-th of the room's people, walking.
  static SyntheticPerson walking(std::uint32_t seed, int index, const SweepTrajectory& camera, PersonLook look);
  static SyntheticPerson sitting(std::uint32_t seed, const Seat& seat, PersonLook look);

  /// Appends the body's parts at `t_s` to `parts`.
  void append_parts(double t_s, std::vector<BodyPart>& parts) const;

 private:
  struct Walk {
    double ring_x_m = 0;  ///< semi-axes of the ring around the room's middle
    double ring_y_m = 0;
    double bearing_rad = 0;   ///< of the loop's middle at t = 0
    double half_arc_rad = 0;  ///< how far the loop reaches to both sides
    double half_width_m = 0;  ///< of the loop, across the ring
    int rounds = 0;           ///< of the loop in one period of the camera's path
    double phase_rad = 0;
    double turn_side = 1;  ///< +1: turns facing the middle
  };
  struct Placement {
    Eigen::Vector2d position;
    double heading_rad;
    double speed_m_s;
  };
  struct Posture;

  SyntheticPerson() = default;
  Placement walk_at(double t_s) const;
  void tabulate_strides();
  Posture walking_posture(double t_s) const;
  Posture sitting_posture(double t_s) const;

  SyntheticMode mode_ = SyntheticMode::Walking;
  std::uint32_t seed_ = 0;
  PersonLook look_;
  double stature_ = 1;  ///< scale of the body; 1 is 1.75 m
  Walk walk_;
  Seat seat_;
  std::vector<double> stride_phase_;  ///< gait phase [rad] at equal steps of a period, ends at a whole number of strides
};

}  // namespace posed
