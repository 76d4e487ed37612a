#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/detections.h"
#include "core/pinhole_camera.h"
#include "slam/depth_grid.h"

namespace posed {

/// Cuts the person out of a detected box by depth, so that the background beside them is kept: planes that go on around the box
/// (desk, floor, wall) are left out, the other depths in the box are clustered (K-means, each cell weighted by how near it is to
/// the box's middle), the cluster that is the person is chosen, and it grows over connected surface a little beyond the box,
/// because detectors cut off elbows. Allocates at construction only. Thread-bound.
class PersonSegmentation {
 public:
  explicit PersonSegmentation(const PinholeCamera& camera);

  /// Replaces `cells` by the person's, ascending. Cells without depth are left out; none where the box shows no depth.
  void segment(const DepthGrid& depth, const BoundingBox& box, std::vector<std::uint32_t>& cells);

 private:
  struct Sample {
    std::uint32_t cell;
    float depth_m;
    float weight;
  };
  struct Cluster {
    float depth_m = 0;
    float weight = 0;
    float deviation_m = 0;
  };
  struct Range {
    int x0, y0, x1, y1;  // [cells] the last ones included
  };

  Range cells_of(const BoundingBox& box, float margin) const;
  void find_background(const DepthGrid& depth, const BoundingBox& box);
  void collect(const DepthGrid& depth, const Range& range);
  Cluster person_cluster() const;
  void close_over_planes(const DepthGrid& depth, const Range& range, std::vector<std::uint32_t>& cells);
  void grow(const DepthGrid& depth, const Range& range, const Cluster& person, std::vector<std::uint32_t>& cells);

  GridCamera camera_;
  int columns_;
  int rows_;
  std::vector<Eigen::Vector3f> around_;      // points of cells around the box
  std::vector<std::uint8_t> is_background_;  // one entry a cell
  std::vector<float> weights_;               // of the cells in the box; 0 elsewhere
  std::vector<Sample> samples_;
  std::vector<std::uint8_t> seen_;
  std::vector<std::uint32_t> queue_;
};

}  // namespace posed
