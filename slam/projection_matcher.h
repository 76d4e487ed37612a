#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/pinhole_camera.h"
#include "core/se3.h"
#include "slam/feature_frame.h"
#include "slam/map_snapshot.h"

namespace posed {

/// Where and how large a landmark should be seen in the frame.
struct ProjectedLandmark {
  std::uint32_t landmark = 0;  ///< index into MapSnapshot::landmarks
  float u = 0;                 ///< ideal pixel
  float v = 0;
  float disparity = 0;    ///< baseline_fx / depth [pixels]
  float view_cosine = 1;  ///< between the viewing ray and the landmark's mean view
  int level = 0;          ///< pyramid level it should be found on
};

struct MatchOptions {
  float radius = 4.0F;      ///< search window's half side on level 0 [pixels]; grows with the level's scale
  int max_distance = 80;    ///< bits of 256
  float max_ratio = 0.85F;  ///< best over second best distance, where both lie on one level
};

constexpr std::int32_t kUnmatched = -1;

/// Finds landmarks among a frame's keypoints near where they project. One matcher a thread (it keeps its scratch memory); does not
/// allocate once warm. Source of the gates: Mur-Artal, Montiel, Tardos, "ORB-SLAM", T-RO 2015, section V-D.
class ProjectionMatcher {
 public:
  ProjectionMatcher(const PinholeCamera& camera, const TrackerConfig& config);

  /// Landmark seen from `T_camera_map`, or nothing where it is behind, outside of the image, out of its range of scale or seen too
  /// obliquely.
  bool project(const MapSnapshot& map, std::uint32_t landmark, const Eigen::Matrix3f& R_camera_map,
               const Eigen::Vector3f& t_camera_map, const FeatureFrame& frame, ProjectedLandmark& projected) const;

  /// Replaces `projected` by the landmarks that `wanted(index)` asks for and that `project` finds in view from `T_map_camera`.
  template <typename Wanted>
  void project_where(const MapSnapshot& map, const Se3& T_map_camera, const FeatureFrame& frame, Wanted&& wanted,
                     std::vector<ProjectedLandmark>& projected) const {
    const Se3 T_camera_map = T_map_camera.inverse();
    const Eigen::Matrix3f R_camera_map = T_camera_map.rotation_matrix().cast<float>();
    const Eigen::Vector3f t_camera_map = T_camera_map.translation().cast<float>();
    projected.clear();
    for (std::uint32_t l = 0; l < map.landmarks.size(); ++l) {
      ProjectedLandmark p;
      if (wanted(l) && project(map, l, R_camera_map, t_camera_map, frame, p)) {
        projected.push_back(p);
      }
    }
  }

  /// Matches `projected` to keypoints whose entry in `landmark_of` is kUnmatched, and writes the landmark's index there; a keypoint
  /// that several landmarks want goes to the nearest descriptor. Returns the number of new matches.
  int match(const MapSnapshot& map, std::span<const ProjectedLandmark> projected, const FeatureFrame& frame,
            const MatchOptions& options, std::vector<std::int32_t>& landmark_of);

  float scale(int level) const { return scale_[static_cast<std::size_t>(level)]; }

 private:
  struct Candidate {
    std::int32_t keypoint = kUnmatched;
    int distance = 0;
  };
  Candidate best_candidate(const SnapshotLandmark& landmark, const ProjectedLandmark& p, const FeatureFrame& frame,
                           const MatchOptions& options, const std::vector<std::int32_t>& landmark_of);

  PinholeCamera camera_;
  std::vector<float> scale_;  // of each pyramid level
  std::vector<std::uint16_t> nearby_;
  std::vector<std::uint16_t> distances_;
  std::vector<std::uint16_t> new_distance_;  // per keypoint: of the match made in this call
  std::vector<std::int32_t> wanted_;         // per keypoint: the landmark of that match
};

}  // namespace posed
