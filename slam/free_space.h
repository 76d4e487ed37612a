#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/clock.h"
#include "core/se3.h"
#include "slam/depth_grid.h"

namespace posed {

/// What the past says of the surface that a cell shows.
enum class CellEvidence : std::uint8_t {
  Unknown,  ///< nothing: it was hidden, out of view, or there is no depth
  Resting,  ///< it was there a while ago, taken for a mover already then
  Still,    ///< it was there a moment ago
  Static,   ///< it was there a while ago
  Moved,    ///< an earlier frame saw through the place where it is now
};

/// How far a depth may be off before it says something [m]: the sensor's noise grows with the square of the depth, and the rest is
/// for slanted surfaces within a cell.
inline float depth_tolerance_m(float depth_m) {
  return 0.08F + 0.02F * depth_m * depth_m;
}

/// Finds surfaces that moved without knowing what they are: a point seen now cannot have been where an earlier frame looked right
/// through. Keeps a few earlier depth grids with their poses. What an object hides says nothing, so neither occlusion nor a surface
/// that comes into view counts as motion. The test against earlier views is that of Bescos et al., "DynaSLAM", RA-L 2018, section
/// III-C, reversed: there a point of the past is sought in the present. Allocates at construction only. Thread-bound.
class FreeSpace {
 public:
  explicit FreeSpace(const PinholeCamera& camera);

  /// Judges each cell of `now`, seen from `T_odom_camera`, against the frames remembered. `evidence`: one entry a cell.
  void judge(const DepthGrid& now, const Se3& T_odom_camera, std::int64_t stamp_ns, std::vector<CellEvidence>& evidence) const;

  /// Keeps the frame where the last one kept is old enough. `is_mover`: one entry a cell; a cell that showed a mover is no evidence
  /// that anything is static.
  void remember(const DepthGrid& now, std::span<const std::uint8_t> is_mover, const Se3& T_odom_camera, std::int64_t stamp_ns);

  /// After a loss of the camera: earlier poses have no bearing on later ones.
  void forget() {
    next_ = 0;
    count_ = 0;
  }

 private:
  struct Reference {
    DepthGrid depth;
    std::vector<std::uint8_t> is_mover;
    Se3 T_odom_camera;
    std::int64_t stamp_ns = 0;
  };
  static constexpr std::size_t kReferences = 8;

  void compare(const DepthGrid& now, const Reference& reference, const Se3& T_reference_now, CellEvidence if_met,
               std::vector<CellEvidence>& evidence) const;

  GridCamera camera_;
  std::vector<Reference> references_;
  std::size_t next_ = 0;  // of the first `count_` references, unless all are in use
  std::size_t count_ = 0;
};

}  // namespace posed
