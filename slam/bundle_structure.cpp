#include "slam/bundle_structure.h"

#include <algorithm>
#include <cassert>
#include <limits>

#include "slam/elimination_order.h"

namespace posed {

void BundleStructure::build(const BundleProblem& problem) {
  group_by_point(problem);
  number_cameras(problem);
  group_by_camera();
  find_pattern();
  order_for_elimination();
}

void BundleStructure::group_by_point(const BundleProblem& problem) {
  const std::size_t points = problem.points.size();
  point_offsets_.assign(points + 1, 0);
  cursor_.assign(points, 0);  // of a point: residuals, which must be as many as its coordinates
  for (const BundleObservation& o : problem.observations) {
    assert(o.camera < problem.cameras.size() && o.point < points);
    if (o.inlier) {
      ++point_offsets_[o.point + 1];
      cursor_[o.point] += o.disparity > 0 ? 3 : 2;
    }
  }
  for (std::size_t p = 0; p < points; ++p) {
    const bool determined = cursor_[p] >= 3;
    cursor_[p] = determined ? point_offsets_[p] : std::numeric_limits<std::uint32_t>::max();
    point_offsets_[p + 1] = point_offsets_[p] + (determined ? point_offsets_[p + 1] : 0);
  }
  observations_.resize(point_offsets_[points]);
  for (const BundleObservation& o : problem.observations) {
    if (o.inlier && cursor_[o.point] != std::numeric_limits<std::uint32_t>::max()) {
      observations_[cursor_[o.point]++] = {o.ideal_pixel, o.disparity, o.pixel_weight, o.disparity_weight, o.camera, kFixedCamera};
    }
  }
}

void BundleStructure::number_cameras(const BundleProblem& problem) {
  constexpr std::int32_t kUnseen = -2;
  unknown_of_camera_.assign(problem.cameras.size(), kUnseen);
  const bool anchored = std::any_of(problem.cameras.begin(), problem.cameras.end(), [](const BundleCamera& c) { return c.fixed; });
  if (!anchored && !unknown_of_camera_.empty()) {
    unknown_of_camera_.front() = kFixedCamera;
  }
  for (const ActiveObservation& o : observations_) {
    if (unknown_of_camera_[o.camera] == kUnseen) {
      unknown_of_camera_[o.camera] = problem.cameras[o.camera].fixed ? kFixedCamera : 0;
    }
  }
  unknowns_.clear();
  for (std::uint32_t c = 0; c < unknown_of_camera_.size(); ++c) {
    if (unknown_of_camera_[c] == 0) {
      unknown_of_camera_[c] = static_cast<std::int32_t>(unknowns_.size());
      unknowns_.push_back(c);
    }
  }
}

void BundleStructure::group_by_camera() {
  camera_offsets_.assign(unknowns_.size() + 1, 0);
  for (ActiveObservation& o : observations_) {
    o.unknown = std::max(unknown_of_camera_[o.camera], kFixedCamera);
    if (o.unknown != kFixedCamera) {
      ++camera_offsets_[static_cast<std::size_t>(o.unknown) + 1];
    }
  }
  for (std::size_t i = 0; i < unknowns_.size(); ++i) {
    camera_offsets_[i + 1] += camera_offsets_[i];
  }
  camera_entries_.resize(camera_offsets_.back());
  cursor_.assign(camera_offsets_.begin(), camera_offsets_.end() - 1);
  for (std::uint32_t p = 0; p < points(); ++p) {
    for (std::uint32_t k = point_offsets_[p]; k < point_offsets_[p + 1]; ++k) {
      if (observations_[k].unknown != kFixedCamera) {
        camera_entries_[cursor_[static_cast<std::size_t>(observations_[k].unknown)]++] = {k, p};
      }
    }
  }
}

/// Two unknown poses share a block where they see a common point.
void BundleStructure::find_pattern() {
  const auto unknowns = static_cast<std::int32_t>(unknowns_.size());
  pattern_.offsets.assign(1, 0);
  pattern_.rows.clear();
  cursor_.assign(unknowns_.size(), std::numeric_limits<std::uint32_t>::max());  // the column in which a row was last entered
  for (std::int32_t j = 0; j < unknowns; ++j) {
    const auto column = static_cast<std::uint32_t>(j);
    for (std::uint32_t e = camera_offsets_[column]; e < camera_offsets_[column + 1]; ++e) {
      const std::uint32_t p = camera_entries_[e].point;
      for (std::uint32_t k = point_offsets_[p]; k < point_offsets_[p + 1]; ++k) {
        const std::int32_t i = observations_[k].unknown;
        if (i >= j && cursor_[static_cast<std::size_t>(i)] != column) {
          cursor_[static_cast<std::size_t>(i)] = column;
          pattern_.rows.push_back(static_cast<std::uint32_t>(i));
        }
      }
    }
    std::sort(pattern_.rows.begin() + pattern_.offsets.back(), pattern_.rows.end());
    pattern_.offsets.push_back(static_cast<std::uint32_t>(pattern_.rows.size()));
  }
}

void BundleStructure::order_for_elimination() {
  cursor_ = unknowns_;
  const std::vector<std::uint32_t> order = elimination_order(pattern_);
  for (std::uint32_t n = 0; n < order.size(); ++n) {
    unknowns_[n] = cursor_[order[n]];
    unknown_of_camera_[unknowns_[n]] = static_cast<std::int32_t>(n);
  }
  group_by_camera();
  find_pattern();
}

}  // namespace posed
