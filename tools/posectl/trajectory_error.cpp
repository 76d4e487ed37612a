#include "tools/posectl/trajectory_error.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <iterator>
#include <numbers>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/clock.h"
#include "core/rigid_alignment.h"

namespace posed {
namespace {

constexpr double kDegreesPerRadian = 180.0 / std::numbers::pi;

bool is_earlier(const StampedPose& pose, std::int64_t stamp_ns) {
  return pose.stamp_ns < stamp_ns;
}

double rms(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) {
    sum += value * value;
  }
  return std::sqrt(sum / static_cast<double>(values.size()));
}

std::optional<RelativeError> relative_error(const std::vector<PosePair>& pairs, const TrajectoryErrorOptions& options) {
  const TimeNs interval_ns = std::llround(options.rpe_interval_s * 1e9);
  const TimeNs slack_ns = std::llround(options.rpe_interval_slack_s * 1e9);
  std::vector<double> translations_m;
  std::vector<double> rotations_deg;
  for (auto begin = pairs.begin(); begin != pairs.end(); ++begin) {
    const TimeNs due_ns = begin->estimate.stamp_ns + interval_ns;
    const auto end = std::lower_bound(begin, pairs.end(), due_ns,
                                      [](const PosePair& pair, TimeNs stamp_ns) { return is_earlier(pair.estimate, stamp_ns); });
    if (end == pairs.end() || end->estimate.stamp_ns - due_ns > slack_ns) {
      continue;
    }
    const Se3 estimated_motion = begin->estimate.T_world_camera.inverse() * end->estimate.T_world_camera;
    const Se3 true_motion = begin->truth.T_world_camera.inverse() * end->truth.T_world_camera;
    const Se3 error = true_motion.inverse() * estimated_motion;
    translations_m.push_back(error.translation().norm());
    rotations_deg.push_back(log_so3(error.rotation()).norm() * kDegreesPerRadian);
  }
  if (translations_m.empty()) {
    return std::nullopt;
  }
  return RelativeError{rms(translations_m), rms(rotations_deg), translations_m.size()};
}

}  // namespace

std::vector<PosePair> pair_by_stamp(const Trajectory& truth, const Trajectory& estimate, double limit_s) {
  std::vector<PosePair> pairs;
  if (truth.empty()) {
    return pairs;
  }
  const TimeNs limit_ns = std::llround(limit_s * 1e9);
  pairs.reserve(estimate.size());
  for (const StampedPose& pose : estimate) {
    auto nearest = std::lower_bound(truth.begin(), truth.end(), pose.stamp_ns, is_earlier);
    if (nearest == truth.end() ||
        (nearest != truth.begin() && pose.stamp_ns - std::prev(nearest)->stamp_ns < nearest->stamp_ns - pose.stamp_ns)) {
      --nearest;
    }
    if (std::abs(nearest->stamp_ns - pose.stamp_ns) <= limit_ns) {
      pairs.push_back({pose, *nearest});
    }
  }
  return pairs;
}

Se3 align_positions(const std::vector<PosePair>& pairs) {
  std::vector<Eigen::Vector3d> estimated;
  std::vector<Eigen::Vector3d> actual;
  for (const PosePair& pair : pairs) {
    estimated.push_back(pair.estimate.T_world_camera.translation());
    actual.push_back(pair.truth.T_world_camera.translation());
  }
  return align_points(actual, estimated);
}

ErrorStatistics error_statistics(std::vector<double> values) {
  assert(!values.empty());
  std::sort(values.begin(), values.end());
  const auto count = static_cast<double>(values.size());
  ErrorStatistics statistics;
  statistics.rmse = rms(values);
  for (const double value : values) {
    statistics.mean += value / count;
  }
  for (const double value : values) {
    statistics.std += (value - statistics.mean) * (value - statistics.mean) / count;
  }
  statistics.std = std::sqrt(statistics.std);
  const std::size_t middle = values.size() / 2;
  statistics.median = values.size() % 2 == 1 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
  statistics.max = values.back();
  return statistics;
}

Result<TrajectoryError> evaluate_trajectory(const Trajectory& truth, const Trajectory& estimate,
                                            const TrajectoryErrorOptions& options) {
  TrajectoryError result;
  result.pairs = pair_by_stamp(truth, estimate, options.pairing_limit_s);
  if (result.pairs.size() < kMinPosePairs) {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("only {} of {} estimated poses have a true pose within {} s; at least {} are needed",
                                  result.pairs.size(), estimate.size(), options.pairing_limit_s, kMinPosePairs));
  }
  result.T_truth_estimate = align_positions(result.pairs);
  std::vector<double> errors_m;
  errors_m.reserve(result.pairs.size());
  for (const PosePair& pair : result.pairs) {
    errors_m.push_back(
        (result.T_truth_estimate * pair.estimate.T_world_camera.translation() - pair.truth.T_world_camera.translation()).norm());
  }
  result.ate_m = error_statistics(std::move(errors_m));
  result.rpe = relative_error(result.pairs, options);
  const std::size_t frames = options.frames.value_or(result.pairs.size());
  result.coverage = static_cast<double>(result.pairs.size()) / static_cast<double>(std::max<std::size_t>(1, frames));
  return result;
}

std::string to_json(const TrajectoryError& error) {
  nlohmann::ordered_json json;
  json["poses"] = error.pairs.size();
  json["coverage"] = error.coverage;
  json["ate_rmse"] = error.ate_m.rmse;
  json["ate_mean"] = error.ate_m.mean;
  json["ate_median"] = error.ate_m.median;
  json["ate_std"] = error.ate_m.std;
  json["ate_max"] = error.ate_m.max;
  json["rpe_trans_1s"] = error.rpe ? nlohmann::ordered_json(error.rpe->translation_rmse_m) : nullptr;
  json["rpe_rot_1s_deg"] = error.rpe ? nlohmann::ordered_json(error.rpe->rotation_rmse_deg) : nullptr;
  return json.dump(2) + "\n";
}

}  // namespace posed
