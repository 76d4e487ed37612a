#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

namespace posed {

/// A closed way on the floor: straight legs between corners that are rounded by arcs. Everything is a function of the arc length s
/// [m] >= 0, which goes on from round to round. World x and y, metres; headings in radians from x towards y, continuous in s, so
/// that they grow by total_turn_rad() a round. Immutable, so thread-safe.
class RoundedPath {
 public:
  /// Leg i leads to corner i; s = 0 is where the leg to corner 0 begins. Each corner turns by less than half a turn, and the legs
  /// are long enough for the arcs at their ends.
  RoundedPath(std::span<const Eigen::Vector2d> corners, double radius_m);

  double length_m() const { return length_m_; }
  double total_turn_rad() const { return total_turn_rad_; }

  Eigen::Vector2d point(double s_m) const;
  double heading_rad(double s_m) const;

  /// Mean of the heading over [s, s + window], window above 0 and at most a round.
  double mean_heading_rad(double s_m, double window_m) const;

 private:
  /// A leg or an arc: constant curvature from `begin_m` on.
  struct Piece {
    double begin_m;
    Eigen::Vector2d start;
    double heading_rad;       ///< at its start
    double curvature_rad_m;   ///< 0 on a leg
    double heading_integral;  ///< of the heading over s, from 0 to begin_m [rad m]
  };

  void append(double length_m, double curvature_rad_m);
  const Piece& piece_at(double s_in_round_m) const;
  /// These take s from 0 to the round's length.
  Eigen::Vector2d point_in_round(double s_m) const;
  double heading_integral(double s_m) const;

  std::vector<Piece> pieces_;  ///< the last one has no length: the state at the round's end
  double length_m_ = 0;
  double total_turn_rad_ = 0;
};

}  // namespace posed
