#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "core/se3.h"
#include "tools/posectl/trajectory.h"

/// How far an estimated trajectory is from the true one: absolute and relative trajectory error as defined in Sturm et al., "A
/// benchmark for the evaluation of RGB-D SLAM systems", IROS 2012. All reentrant.
namespace posed {

struct TrajectoryErrorOptions {
  double pairing_limit_s = 0.02;      ///< an estimate is paired with the nearest true pose where that is at most so far in time
  double rpe_interval_s = 1.0;        ///< over which the relative error is taken
  double rpe_interval_slack_s = 0.1;  ///< by how much the interval between two stamps may be longer
  std::optional<std::size_t> frames;  ///< images of the sequence, for coverage; else coverage is of the paired poses themselves
};

struct ErrorStatistics {
  double rmse = 0;
  double mean = 0;
  double median = 0;
  double std = 0;  ///< of the population
  double max = 0;
};

struct RelativeError {
  double translation_rmse_m = 0;
  double rotation_rmse_deg = 0;
  std::size_t intervals = 0;
};

struct PosePair {
  StampedPose estimate;
  StampedPose truth;
};

struct TrajectoryError {
  std::vector<PosePair> pairs;
  Se3 T_truth_estimate;  ///< brings the estimate onto the truth, in the least squares sense over positions
  ErrorStatistics ate_m;
  std::optional<RelativeError> rpe;  ///< nothing where no two poses are one interval apart
  double coverage = 0;               ///< paired poses to frames of the sequence
};

/// Fewer pairs than this say nothing about a trajectory.
constexpr std::size_t kMinPosePairs = 10;

/// Each estimate with the true pose that is nearest in time (the later one of two as near), within the limit.
std::vector<PosePair> pair_by_stamp(const Trajectory& truth, const Trajectory& estimate, double limit_s);

/// The rigid transform that brings the estimated positions onto the true ones (core/rigid_alignment.h). Needs at least three pairs.
Se3 align_positions(const std::vector<PosePair>& pairs);

/// Needs at least one value.
ErrorStatistics error_statistics(std::vector<double> values);

/// Error: InvalidArgument where fewer than `kMinPosePairs` poses can be paired.
Result<TrajectoryError> evaluate_trajectory(const Trajectory& truth, const Trajectory& estimate,
                                            const TrajectoryErrorOptions& options);

/// As JSON, one object: poses, coverage, ate_rmse, ate_mean, ate_median, ate_std, ate_max [m], rpe_trans_1s [m], rpe_rot_1s_deg
/// (null where there are none).
std::string to_json(const TrajectoryError& error);

}  // namespace posed
