#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "config/config.h"
#include "core/pinhole_camera.h"
#include "core/rgbd_frame.h"
#include "core/se3.h"
#include "slam/features.h"

namespace posed {

/// The features of one frame placed in space: undistorted, with depth, and in a grid for search by position. Index i of every
/// vector is one keypoint. All vectors keep their capacity, so assigning a new frame to it does not allocate once warm. Reentrant.
class FeatureFrame {
 public:
  /// `capacity`: keypoints to make room for.
  FeatureFrame(const PinholeCamera& camera, std::size_t capacity);

  /// Completes `features()` after the extractor has filled them: undistorts, looks depths up, sorts into the grid. `T_depth_color`
  /// is the motion of the camera between the two images: points of the camera frame when the colour image was taken, seen from the
  /// camera frame when the depth image was. Depths are those at the time of the colour image; where the surface cannot be followed
  /// from the one image to the other (an edge), there is none.
  void place(const PinholeCamera& camera, ImageView<const float> depth_m, const std::optional<Se3>& T_depth_color = std::nullopt);

  /// The same, but `trust_of(keypoint, depth_m)` says how far each keypoint is to be trusted, 0 to 1; those with 0 are left out.
  template <typename TrustOf>
  void place(const PinholeCamera& camera, ImageView<const float> depth_m, const std::optional<Se3>& T_depth_color,
             TrustOf&& trust_of) {
    look_up(camera, depth_m, T_depth_color);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < features_.keypoints.size(); ++i) {
      const float trust = trust_of(features_.keypoints[i], depth_m_[i]);
      if (trust > 0) {
        features_.keypoints[kept] = features_.keypoints[i];
        features_.descriptors[kept] = features_.descriptors[i];
        ideal_pixels_[kept] = ideal_pixels_[i];
        depth_m_[kept] = depth_m_[i];
        trust_[kept] = trust;
        ++kept;
      }
    }
    shrink(kept);
    complete(camera);
  }

  /// Becomes a frame that was placed before: the features, ideal pixels and depths of a stored keyframe, of equal length.
  void place_stored(const PinholeCamera& camera, const Features& features, const std::vector<Eigen::Vector2f>& ideal_pixels,
                    const std::vector<float>& depth_m);

  Features& features() { return features_; }
  const Features& features() const { return features_; }
  std::size_t size() const { return features_.keypoints.size(); }

  const std::vector<Eigen::Vector2f>& ideal_pixels() const { return ideal_pixels_; }
  const std::vector<float>& depth_m() const { return depth_m_; }      ///< 0: none
  const std::vector<float>& trust() const { return trust_; }          ///< 0 to 1: of the measurement's weight
  const std::vector<float>& disparity() const { return disparity_; }  ///< baseline_fx / depth [pixels]; 0: none

  /// Indices of the keypoints within `radius` [pixels] of an ideal pixel along both axes and on a level in [min_level, max_level].
  /// The result lies in `scratch` and is valid until its next use.
  std::span<const std::uint16_t> search(float u, float v, float radius, int min_level, int max_level,
                                        std::vector<std::uint16_t>& scratch) const;

  /// Whether an ideal pixel can lie in the image.
  bool in_view(float u, float v) const { return u >= min_u_ && u < max_u_ && v >= min_v_ && v < max_v_; }

 private:
  static constexpr int kColumns = 48;
  static constexpr int kRows = 36;
  int column_of(float u) const;
  int row_of(float v) const;
  void look_up(const PinholeCamera& camera, ImageView<const float> depth_m, const std::optional<Se3>& T_depth_color);
  void shrink(std::size_t count);
  void complete(const PinholeCamera& camera);  // disparities and the grid, out of pixels and depths

  float min_u_, min_v_, max_u_, max_v_;  // bounds of the undistorted image
  float columns_per_pixel_, rows_per_pixel_;
  Features features_;
  std::vector<Eigen::Vector2f> ideal_pixels_;
  std::vector<float> depth_m_;
  std::vector<float> trust_;
  std::vector<float> disparity_;
  std::vector<std::uint16_t> cell_begin_;  // kColumns * kRows + 1 offsets into cell_keypoints_
  std::vector<std::uint16_t> cell_keypoints_;
  std::vector<std::uint16_t> cell_of_;
};

}  // namespace posed
