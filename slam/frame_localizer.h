#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "slam/feature_frame.h"
#include "slam/map_snapshot.h"
#include "slam/measurement_noise.h"
#include "slam/pose_solver.h"
#include "slam/projection_matcher.h"

namespace posed {

/// Finds a frame's pose from a guess by matching landmarks near where they project and solving; keeps matches and solution from
/// step to step. Does not allocate once warm. One object a thread.
class FrameLocalizer {
 public:
  /// Matches and the solution from them, to be gone back to.
  struct Result {
    std::vector<std::int32_t> landmark_of;  ///< by keypoint: index into the map, or kUnmatched
    int matches = 0;                        ///< before outliers were rejected
    PoseSolution solution;
  };

  FrameLocalizer(const PinholeCamera& camera, const TrackerConfig& config, std::size_t landmark_capacity);

  /// No match, no solution.
  void reset(const FeatureFrame& frame);

  /// Takes a pose from elsewhere, without matches.
  void begin_at(const FeatureFrame& frame, const Se3& T_map_camera);

  /// Matches those landmarks of the map whose id is in `wanted` (ascending; empty: all) and forgets earlier matches.
  void match(const MapSnapshot& map, const FeatureFrame& frame, std::span<const LandmarkId> wanted, const Se3& T_map_camera,
             float radius);

  /// Solves from the present matches; outliers lose theirs. False where there is no solution.
  bool solve(const MapSnapshot& map, const FeatureFrame& frame, const Se3& initial);

  /// Takes the match of each keypoint that `leaves(index)` names away; says how many there were. `solve` is to follow.
  template <typename Leaves>
  int drop_where(Leaves&& leaves) {
    int dropped = 0;
    for (std::size_t i = 0; i < result_.landmark_of.size(); ++i) {
      if (result_.landmark_of[i] != kUnmatched && leaves(i)) {
        result_.landmark_of[i] = kUnmatched;
        ++dropped;
      }
    }
    return dropped;
  }

  /// Adds matches with landmarks that have none around the present solution, and solves again. False where fewer than
  /// `min_inliers` agree.
  bool refine(const MapSnapshot& map, const FeatureFrame& frame, int min_inliers);

  const Result& result() const { return result_; }
  const PoseSolution& solution() const { return result_.solution; }
  const std::vector<std::int32_t>& landmark_of() const { return result_.landmark_of; }
  int matches() const { return result_.matches; }
  void restore(const Result& result) { result_ = result; }  ///< an earlier one of the same frame
  TimeNs take_solve_ns();                                   ///< spent solving since the last call

 private:
  PinholeCamera camera_;
  MeasurementNoise noise_;
  ProjectionMatcher matcher_;
  Result result_;
  TimeNs solve_ns_ = 0;
  std::vector<ProjectedLandmark> projected_;
  std::vector<PoseObservation> observations_;
  std::vector<std::uint16_t> observed_keypoint_;
  std::vector<std::uint8_t> landmark_taken_;
};

}  // namespace posed
