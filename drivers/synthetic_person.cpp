#include "drivers/synthetic_person.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "drivers/synthetic_hash.h"

namespace posed {

namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kStride_m = 1.25;  ///< two steps
constexpr int kStrideSamples = 1200;

// Proportions of a body 1.75 m tall [m].
constexpr double kHipHeight = 0.92;
constexpr double kThigh = 0.43;
constexpr double kShin = 0.42;
constexpr double kTorso = 0.46;
constexpr double kUpperArm = 0.29;
constexpr double kForearm = 0.25;
constexpr double kHipHalf = 0.095;
constexpr double kShoulderHalf = 0.2;

double hash_uniform(std::uint32_t seed, std::uint32_t index) {
  return static_cast<double>(hash32(seed, index) >> 8) * 0x1p-24;
}

/// A slow, irregular motion in [-1, 1]: three sines whose frequencies have no common period worth noticing.
double wander(std::uint32_t seed, std::uint32_t index, double t_s) {
  const auto phase = [&](std::uint32_t k) { return kTurn * hash_uniform(seed, 16 * index + k); };
  const double pace = 0.8 + 0.4 * hash_uniform(seed, 16 * index + 7);
  return 0.5 * std::sin(pace * 0.9 * t_s + phase(0)) + 0.3 * std::sin(pace * 1.7 * t_s + phase(1)) +
         0.2 * std::sin(pace * 3.1 * t_s + phase(2));
}

/// Direction of a limb in the torso's frame: hangs down at (0, 0), `forward` swings it to +x, `outward` to `side`.
Eigen::Vector3d limb_direction(double forward, double outward, double side) {
  return {std::sin(forward) * std::cos(outward), side * std::sin(outward), -std::cos(forward) * std::cos(outward)};
}

struct Shape {
  double base_radius;
  double tip_radius;
  Eigen::Vector2f squeeze{1, 1};
};

/// Collects parts of a body that is scaled by its stature and stands at a pose in the world.
class BodyBuilder {
 public:
  BodyBuilder(std::vector<BodyPart>& parts, double stature) : parts_(parts), stature_(stature) {}

  /// `front` is where the part's texture has its middle; all in the world frame.
  void add(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Eigen::Vector3d& front, const Shape& shape,
           std::uint32_t texture) {
    BodyPart part;
    const Eigen::Vector3d axis = (to - from).normalized();
    const Eigen::Vector3d side = axis.cross(front).normalized();
    part.R_world_part.col(0) = side.cross(axis).cast<float>();
    part.R_world_part.col(1) = side.cast<float>();
    part.R_world_part.col(2) = axis.cast<float>();
    part.base = from.cast<float>();
    part.squeeze = shape.squeeze;
    part.length_m = static_cast<float>((to - from).norm());
    part.base_radius_m = static_cast<float>(shape.base_radius * stature_);
    part.tip_radius_m = static_cast<float>(shape.tip_radius * stature_);
    part.texture = texture;
    parts_.push_back(part);
  }

 private:
  std::vector<BodyPart>& parts_;
  double stature_;
};

}  // namespace

/// Joint angles [rad]; index 0 is the left side, 1 the right.
struct SyntheticPerson::Posture {
  Eigen::Vector2d position{0, 0};
  double heading = 0;
  double hip_height = kHipHeight;  ///< of a body of unit stature [m]
  double lean = 0;                 ///< torso forwards
  double sway = 0;                 ///< torso to its left
  double twist = 0;                ///< shoulders against the hips
  double head_yaw = 0;
  double head_pitch = 0;
  double hip[2] = {0, 0};
  double knee[2] = {0, 0};
  double shoulder[2] = {0, 0};
  double shoulder_out[2] = {0.12, 0.12};
  double elbow[2] = {0.3, 0.3};
};

SyntheticPerson SyntheticPerson::walking(std::uint32_t seed, int index, const SweepTrajectory& camera, PersonLook look) {
  HashRng rng(seed);
  SyntheticPerson person;
  person.mode_ = SyntheticMode::Walking;
  person.seed_ = seed;
  person.look_ = look;
  person.stature_ = static_cast<double>(rng.uniform(0.93F, 1.06F));
  // Even ones walk on the inner ring, odd ones on the outer; each further pair has its own quarter of the room.
  const bool inner = index % 2 == 0;
  Walk& walk = person.walk_;
  walk.ring_x_m = inner ? 1.5 : 2.05;
  walk.ring_y_m = inner ? 1.2 : 1.62;
  walk.half_width_m = inner ? 0.08 : 0.1;
  walk.half_arc_rad = inner ? 0.95 : 0.85;
  walk.rounds = inner ? 7 : 6;
  walk.bearing_rad = camera.start_heading_rad() + (index / 2) * kTurn / 4;
  walk.phase_rad = kTurn * static_cast<double>(rng.uniform());
  walk.turn_side = rng.index(2) == 0 ? 1.0 : -1.0;
  person.tabulate_strides();
  return person;
}

SyntheticPerson SyntheticPerson::sitting(std::uint32_t seed, const Seat& seat, PersonLook look) {
  HashRng rng(seed);
  SyntheticPerson person;
  person.mode_ = SyntheticMode::Sitting;
  person.seed_ = seed;
  person.look_ = look;
  person.stature_ = static_cast<double>(rng.uniform(0.93F, 1.06F));
  person.seat_ = seat;
  return person;
}

SyntheticPerson::Placement SyntheticPerson::walk_at(double t_s) const {
  const double sweep = kTurn / SweepTrajectory::kPeriod_s;
  const double rate = walk_.rounds * sweep;
  const double phase = rate * t_s + walk_.phase_rad;
  const double bearing = walk_.bearing_rad + sweep * t_s + walk_.half_arc_rad * std::sin(phase);
  const double bearing_rate = sweep + walk_.half_arc_rad * rate * std::cos(phase);
  const double offset = walk_.half_width_m * std::cos(phase);
  const Eigen::Vector2d tangent(-walk_.ring_x_m * std::sin(bearing), walk_.ring_y_m * std::cos(bearing));
  // The heading follows the ring one way or the other and swings over smoothly where the walk turns back.
  const double along = std::cos(phase);
  const double turn = walk_.turn_side * std::atan2(0.25 * (1 - along * along), along);
  return {.position = {(walk_.ring_x_m + offset) * std::cos(bearing), (walk_.ring_y_m + offset) * std::sin(bearing)},
          .heading_rad = std::atan2(tangent.y(), tangent.x()) + turn,
          .speed_m_s = std::abs(bearing_rate) * tangent.norm()};
}

void SyntheticPerson::tabulate_strides() {
  constexpr double kStep_s = SweepTrajectory::kPeriod_s / kStrideSamples;
  stride_phase_.assign(kStrideSamples + 1, 0.0);
  for (std::size_t i = 1; i < stride_phase_.size(); ++i) {
    stride_phase_[i] = stride_phase_[i - 1] + walk_at((static_cast<double>(i) - 0.5) * kStep_s).speed_m_s * kStep_s;
  }
  // A whole number of strides in a period, so that the gait has no jump where it begins again.
  const double strides = std::max(1.0, std::round(stride_phase_.back() / kStride_m));
  const double scale = strides * kTurn / stride_phase_.back();
  for (double& phase : stride_phase_) {
    phase *= scale;
  }
}

SyntheticPerson::Posture SyntheticPerson::walking_posture(double t_s) const {
  const double t = std::fmod(t_s, SweepTrajectory::kPeriod_s);
  const double sample = t / SweepTrajectory::kPeriod_s * kStrideSamples;
  const auto index = std::min(static_cast<std::size_t>(sample), static_cast<std::size_t>(kStrideSamples - 1));
  const double weight = sample - static_cast<double>(index);
  const double gait = stride_phase_[index] + weight * (stride_phase_[index + 1] - stride_phase_[index]);

  const Placement placement = walk_at(t);
  const double vigour = std::min(1.0, placement.speed_m_s / 0.8);
  Posture p;
  p.position = placement.position;
  p.heading = placement.heading_rad;
  p.hip_height = kHipHeight - vigour * (0.015 - 0.015 * std::cos(2 * gait));
  p.lean = 0.05 + 0.02 * std::sin(2 * gait);
  p.sway = 0.03 * vigour * std::sin(gait);
  p.twist = 0.12 * vigour * std::sin(gait);
  p.head_yaw = 0.5 * wander(seed_, 1, t_s);
  p.head_pitch = 0.12 + 0.15 * wander(seed_, 2, t_s);
  for (int side = 0; side < 2; ++side) {
    const double leg = gait + side * std::numbers::pi;
    p.hip[side] = vigour * 0.45 * std::sin(leg) + 0.05;
    p.knee[side] = 0.08 + vigour * 0.45 * (1 + std::cos(leg - 0.5));  // bent most while the leg swings forward
    p.shoulder[side] = -0.45 * vigour * std::sin(leg);
    p.elbow[side] = 0.3 - 0.2 * vigour * std::sin(leg);
  }
  return p;
}

SyntheticPerson::Posture SyntheticPerson::sitting_posture(double t_s) const {
  Posture p;
  p.position = seat_.position.cast<double>();
  p.heading = static_cast<double>(seat_.yaw_rad) + 0.04 * wander(seed_, 10, t_s);
  p.hip_height = (static_cast<double>(SyntheticScene::kSeatHeight_m) + 0.1) / stature_;
  p.lean = 0.05 + 0.12 * wander(seed_, 0, t_s);
  p.sway = 0.08 * wander(seed_, 3, t_s);
  p.twist = 0.2 * wander(seed_, 4, t_s);
  p.head_yaw = 0.6 * wander(seed_, 1, t_s);
  p.head_pitch = 0.1 + 0.2 * wander(seed_, 2, t_s);
  for (int side = 0; side < 2; ++side) {
    const auto s = static_cast<std::uint32_t>(side);
    p.hip[side] = 1.5;
    p.knee[side] = 1.45 + 0.1 * wander(seed_, 11 + s, t_s);
    p.shoulder[side] = 0.45 + 0.35 * wander(seed_, 5 + s, t_s);
    p.shoulder_out[side] = 0.25 + 0.15 * wander(seed_, 13 + s, t_s);
    p.elbow[side] = 1.3 + 0.6 * wander(seed_, 7 + s, t_s);
  }
  return p;
}

void SyntheticPerson::append_parts(double t_s, std::vector<BodyPart>& parts) const {
  const Posture p = mode_ == SyntheticMode::Walking ? walking_posture(t_s) : sitting_posture(t_s);
  const Eigen::Quaterniond R_world_hips(Eigen::AngleAxisd(p.heading, Eigen::Vector3d::UnitZ()));
  const Eigen::Quaterniond R_world_torso = R_world_hips * Eigen::AngleAxisd(p.twist, Eigen::Vector3d::UnitZ()) *
                                           Eigen::AngleAxisd(p.lean, Eigen::Vector3d::UnitY()) *
                                           Eigen::AngleAxisd(-p.sway, Eigen::Vector3d::UnitX());
  const Eigen::Quaterniond R_world_head = R_world_torso * Eigen::AngleAxisd(p.head_yaw, Eigen::Vector3d::UnitZ()) *
                                          Eigen::AngleAxisd(p.head_pitch, Eigen::Vector3d::UnitY());
  const Eigen::Vector3d hips(p.position.x(), p.position.y(), p.hip_height * stature_);
  const auto from_hips = [&](double x, double y, double z) -> Eigen::Vector3d {
    return hips + R_world_hips * Eigen::Vector3d(x, y, z) * stature_;
  };
  const auto from_torso = [&](double x, double y, double z) -> Eigen::Vector3d {
    return hips + R_world_torso * Eigen::Vector3d(x, y, z) * stature_;
  };
  const Eigen::Vector3d front = R_world_torso * Eigen::Vector3d::UnitX();
  const Eigen::Vector3d hips_front = R_world_hips * Eigen::Vector3d::UnitX();
  const Eigen::Vector3d up = R_world_hips * Eigen::Vector3d(0.2, 0, 1);

  BodyBuilder body(parts, stature_);
  body.add(from_hips(0, 0, -0.04), from_hips(0, 0, 0.1), hips_front, {0.125, 0.12, {0.85F, 1.3F}}, look_.trousers);
  body.add(from_torso(0, 0, 0.1), from_torso(0.01, 0, kTorso - 0.06), front, {0.115, 0.14, {0.85F, 1.35F}}, look_.shirt);
  const Eigen::Vector3d neck = from_torso(0.01, 0, kTorso + 0.05);
  const auto from_neck = [&](double x, double y, double z) -> Eigen::Vector3d {
    return neck + R_world_head * Eigen::Vector3d(x, y, z) * stature_;
  };
  const Eigen::Vector3d face = R_world_head * Eigen::Vector3d::UnitX();
  body.add(neck, from_neck(0.01, 0, 0.1), face, {0.055, 0.052}, look_.skin);
  body.add(from_neck(0.02, 0, 0.12), from_neck(0.015, 0, 0.2), face, {0.078, 0.098, {1.0F, 0.85F}}, look_.head);
  body.add(from_neck(-0.008, 0, 0.2), from_neck(-0.012, 0, 0.225), face, {0.1, 0.1, {1.0F, 0.92F}}, look_.hair);

  for (int side = 0; side < 2; ++side) {
    const double sign = side == 0 ? 1.0 : -1.0;
    const Eigen::Vector3d shoulder = from_torso(0, sign * kShoulderHalf, kTorso);
    const Eigen::Vector3d upper = R_world_torso * limb_direction(p.shoulder[side], p.shoulder_out[side], sign);
    const Eigen::Vector3d fore = R_world_torso * limb_direction(p.shoulder[side] + p.elbow[side], p.shoulder_out[side] * 0.3, sign);
    const Eigen::Vector3d elbow = shoulder + upper * kUpperArm * stature_;
    const Eigen::Vector3d wrist = elbow + fore * kForearm * stature_;
    body.add(shoulder, elbow, front + up, {0.06, 0.045}, look_.shirt);
    body.add(elbow, wrist, front + up, {0.045, 0.032}, look_.shirt);
    body.add(wrist + fore * 0.03 * stature_, wrist + fore * 0.1 * stature_, front + up, {0.04, 0.034, {0.75F, 1.0F}}, look_.skin);

    const Eigen::Vector3d hip = from_hips(0, sign * kHipHalf, -0.02);
    const Eigen::Vector3d knee = hip + R_world_hips * limb_direction(p.hip[side], 0.03, sign) * kThigh * stature_;
    const Eigen::Vector3d shin = R_world_hips * limb_direction(p.hip[side] - p.knee[side], 0.02, sign);
    const Eigen::Vector3d ankle = knee + shin * kShin * stature_;
    const Eigen::Vector3d toes = R_world_hips * limb_direction(p.hip[side] - p.knee[side] + 1.5, 0.1, sign);
    body.add(hip, knee, hips_front + up, {0.085, 0.06}, look_.trousers);
    body.add(knee, ankle, hips_front + up, {0.058, 0.042}, look_.trousers);
    body.add(ankle - toes * 0.04 * stature_, ankle + toes * 0.14 * stature_, up, {0.045, 0.038}, look_.shoes);
  }
}

}  // namespace posed
