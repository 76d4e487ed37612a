#include "drivers/synthetic_path.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace posed {

namespace {

struct Round {
  double number;
  double s_m;  ///< within the round, from 0 to its length
};

Round split(double s_m, double length_m) {
  const double number = std::floor(s_m / length_m);
  return {number, std::clamp(s_m - number * length_m, 0.0, length_m)};
}

double turn_between(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  return std::atan2(from.x() * to.y() - from.y() * to.x(), from.dot(to));
}

}  // namespace

RoundedPath::RoundedPath(std::span<const Eigen::Vector2d> corners, double radius_m) {
  const std::size_t count = corners.size();
  const auto leg = [&](std::size_t i) -> Eigen::Vector2d { return corners[i % count] - corners[(i + count - 1) % count]; };
  // What an arc takes of the legs on both of its sides.
  const auto cut = [&](std::size_t i) { return radius_m * std::tan(std::abs(turn_between(leg(i), leg(i + 1))) / 2); };

  const Eigen::Vector2d first = leg(0).normalized();
  pieces_.push_back({.begin_m = 0,
                     .start = corners[count - 1] + cut(count - 1) * first,
                     .heading_rad = std::atan2(first.y(), first.x()),
                     .curvature_rad_m = 0,
                     .heading_integral = 0});
  for (std::size_t i = 0; i < count; ++i) {
    append(leg(i).norm() - cut(i + count - 1) - cut(i), 0);
    const double turn = turn_between(leg(i), leg(i + 1));
    append(radius_m * std::abs(turn), std::copysign(1 / radius_m, turn));
  }
  length_m_ = pieces_.back().begin_m;
  total_turn_rad_ = pieces_.back().heading_rad - pieces_.front().heading_rad;
}

/// Gives the last piece its curvature, and begins the next one behind it.
void RoundedPath::append(double length_m, double curvature_rad_m) {
  assert(length_m >= 0);
  Piece& piece = pieces_.back();
  piece.curvature_rad_m = curvature_rad_m;
  length_m_ = piece.begin_m + length_m;
  const Piece next{.begin_m = length_m_,
                   .start = point_in_round(length_m_),
                   .heading_rad = piece.heading_rad + curvature_rad_m * length_m,
                   .curvature_rad_m = 0,
                   .heading_integral = heading_integral(length_m_)};
  pieces_.push_back(next);
}

const RoundedPath::Piece& RoundedPath::piece_at(double s_in_round_m) const {
  const auto after = std::upper_bound(pieces_.begin() + 1, pieces_.end(), s_in_round_m,
                                      [](double s, const Piece& piece) { return s < piece.begin_m; });
  return *(after - 1);
}

Eigen::Vector2d RoundedPath::point(double s_m) const {
  return point_in_round(split(s_m, length_m_).s_m);
}

Eigen::Vector2d RoundedPath::point_in_round(double s_m) const {
  const Piece& piece = piece_at(s_m);
  const double along = s_m - piece.begin_m;
  const double h = piece.heading_rad;
  const double k = piece.curvature_rad_m;
  if (k == 0) {
    return piece.start + along * Eigen::Vector2d(std::cos(h), std::sin(h));
  }
  const double end = h + k * along;
  return piece.start + Eigen::Vector2d(std::sin(end) - std::sin(h), std::cos(h) - std::cos(end)) / k;
}

double RoundedPath::heading_rad(double s_m) const {
  const Round round = split(s_m, length_m_);
  const Piece& piece = piece_at(round.s_m);
  return piece.heading_rad + piece.curvature_rad_m * (round.s_m - piece.begin_m) + round.number * total_turn_rad_;
}

double RoundedPath::heading_integral(double s_m) const {
  const Piece& piece = piece_at(s_m);
  const double along = s_m - piece.begin_m;
  return piece.heading_integral + along * (piece.heading_rad + 0.5 * piece.curvature_rad_m * along);
}

double RoundedPath::mean_heading_rad(double s_m, double window_m) const {
  const Round round = split(s_m, length_m_);
  const double end = round.s_m + window_m;
  double integral = 0;
  if (end <= length_m_) {
    integral = heading_integral(end) - heading_integral(round.s_m);
  } else {
    const double beyond = end - length_m_;
    integral = heading_integral(length_m_) - heading_integral(round.s_m) + heading_integral(beyond) + beyond * total_turn_rad_;
  }
  return integral / window_m + round.number * total_turn_rad_;
}

}  // namespace posed
