#include "slam/person_segmentation.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "slam/background_plane.h"
#include "slam/surface.h"

namespace posed {

namespace {

constexpr int kClusters = 3;
constexpr int kIterations = 6;
constexpr float kOneSurface_m = 0.25F;    // clusters nearer to each other than this are one
constexpr float kLeastShare = 0.25F;      // of the box's weight, that the nearest cluster must have to be the person
constexpr float kBodyDepth_m = 0.45F;     // half of it: how far a body reaches from its middle, arms included
constexpr float kGrowMargin = 0.12F;      // of the box's sides, how far a person may reach beyond it
constexpr int kPlanes = 2;                // around a box: a desk and a wall
constexpr float kAroundMargin = 0.5F;     // of the box's sides, where they are looked for
constexpr float kLeastPlaneShare = 0.2F;  // of the cells there, that a plane must hold
constexpr std::size_t kLeastAround = 60;  // [cells]
constexpr int kWidestGap = 6;             // [cells] where a plane cuts through a person
constexpr float kLeastPieceShare = 0.2F;  // a piece of less weight than this share of the largest one's is not the person's

}  // namespace

PersonSegmentation::PersonSegmentation(const PinholeCamera& camera) : camera_(camera) {
  const DepthGrid grid(camera.intrinsics().width, camera.intrinsics().height);
  columns_ = grid.columns();
  rows_ = grid.rows();
  around_.reserve(grid.size());
  is_background_.resize(grid.size());
  weights_.resize(grid.size());
  samples_.reserve(grid.size());
  seen_.resize(grid.size());
  queue_.reserve(grid.size());
}

PersonSegmentation::Range PersonSegmentation::cells_of(const BoundingBox& box, float margin) const {
  const float dx = margin * (box.x_max - box.x_min);
  const float dy = margin * (box.y_max - box.y_min);
  const auto cell = [](float pixel, int count) {
    return std::clamp(static_cast<int>(std::floor((pixel + 0.5F) / DepthGrid::kCell)), 0, count - 1);
  };
  return {cell(box.x_min - dx, columns_), cell(box.y_min - dy, rows_), cell(box.x_max + dx, columns_), cell(box.y_max + dy, rows_)};
}

/// What lies on a plane that is large around the box too, is no person: without this, one who leans over a desk would be as large
/// as it.
void PersonSegmentation::find_background(const DepthGrid& depth, const BoundingBox& box) {
  const Range inner = cells_of(box, kGrowMargin);
  const Range outer = cells_of(box, kAroundMargin);
  std::fill(is_background_.begin(), is_background_.end(), std::uint8_t{0});
  const auto for_each_outer = [&](auto&& visit) {
    for (int y = outer.y0; y <= outer.y1; ++y) {
      for (int x = outer.x0; x <= outer.x1; ++x) {
        if (const std::size_t cell = depth.cell(x, y); depth[cell] > 0 && is_background_[cell] == 0) {
          visit(cell, x >= inner.x0 && x <= inner.x1 && y >= inner.y0 && y <= inner.y1);
        }
      }
    }
  };
  for (int i = 0; i < kPlanes; ++i) {
    around_.clear();
    for_each_outer([&](std::size_t cell, bool is_inner) {
      if (!is_inner) {
        around_.push_back(camera_.point(cell, depth[cell]));
      }
    });
    if (around_.size() < kLeastAround) {
      return;
    }
    const std::optional<Plane> plane = find_plane(around_, kLeastPlaneShare);
    if (!plane) {
      return;
    }
    for_each_outer([&](std::size_t cell, bool) { is_background_[cell] = plane->holds(camera_.point(cell, depth[cell])) ? 1 : 0; });
  }
}

void PersonSegmentation::collect(const DepthGrid& depth, const Range& range) {
  samples_.clear();
  std::fill(weights_.begin(), weights_.end(), 0.0F);
  const float half_width = 0.5F * static_cast<float>(range.x1 - range.x0 + 1);
  const float half_height = 0.5F * static_cast<float>(range.y1 - range.y0 + 1);
  for (int y = range.y0; y <= range.y1; ++y) {
    for (int x = range.x0; x <= range.x1; ++x) {
      const std::size_t cell = depth.cell(x, y);
      if (depth[cell] > 0 && is_background_[cell] == 0) {
        const float off_x = std::abs(static_cast<float>(x - range.x0) + 0.5F - half_width) / half_width;
        const float off_y = std::abs(static_cast<float>(y - range.y0) + 0.5F - half_height) / half_height;
        weights_[cell] = (1.05F - off_x) * (1.25F - off_y);
        samples_.push_back({static_cast<std::uint32_t>(cell), depth[cell], weights_[cell]});
      }
    }
  }
}

/// Lloyd's algorithm in one dimension; the samples are sorted by depth, so the clusters begin at quantiles.
PersonSegmentation::Cluster PersonSegmentation::person_cluster() const {
  std::array<Cluster, kClusters> clusters;
  for (int k = 0; k < kClusters; ++k) {
    const std::size_t quantile = (2 * static_cast<std::size_t>(k) + 1) * samples_.size() / (2 * kClusters);
    clusters[static_cast<std::size_t>(k)].depth_m = samples_[quantile].depth_m;
  }
  float all = 0;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    std::array<float, kClusters> weight{};
    std::array<float, kClusters> sum{};
    std::array<float, kClusters> square{};
    for (const Sample& s : samples_) {
      const auto nearest =
          static_cast<std::size_t>(std::min_element(clusters.begin(), clusters.end(),
                                                    [&](const Cluster& a, const Cluster& b) {
                                                      return std::abs(a.depth_m - s.depth_m) < std::abs(b.depth_m - s.depth_m);
                                                    }) -
                                   clusters.begin());
      weight[nearest] += s.weight;
      sum[nearest] += s.weight * s.depth_m;
      square[nearest] += s.weight * s.depth_m * s.depth_m;
    }
    all = 0;
    for (std::size_t k = 0; k < kClusters; ++k) {
      all += weight[k];
      if (weight[k] > 0) {
        const float mean = sum[k] / weight[k];
        clusters[k] = {mean, weight[k], std::sqrt(std::max(0.0F, square[k] / weight[k] - mean * mean))};
      } else {
        clusters[k].weight = 0;
      }
    }
  }
  std::sort(clusters.begin(), clusters.end(), [](const Cluster& a, const Cluster& b) { return a.depth_m < b.depth_m; });
  for (std::size_t k = 1; k < kClusters; ++k) {
    Cluster& front = clusters[k - 1];
    Cluster& back = clusters[k];
    if (front.weight > 0 && back.depth_m - front.depth_m < kOneSurface_m) {
      const float weight = front.weight + back.weight;
      const float mean = (front.weight * front.depth_m + back.weight * back.depth_m) / weight;
      back = {mean, weight, std::max(front.deviation_m, back.deviation_m) + 0.5F * (back.depth_m - front.depth_m)};
      front.weight = 0;
    }
  }
  // Who fills a good part of the box's middle and is in front is the person; else whatever fills most of it.
  const auto in_front =
      std::find_if(clusters.begin(), clusters.end(), [&](const Cluster& c) { return c.weight >= kLeastShare * all; });
  return in_front != clusters.end() ? *in_front
                                    : *std::max_element(clusters.begin(), clusters.end(),
                                                        [](const Cluster& a, const Cluster& b) { return a.weight < b.weight; });
}

/// Where a plane cuts through the person, the cells on it are theirs: those with the person on both sides of a short gap.
void PersonSegmentation::close_over_planes(const DepthGrid& depth, const Range& range, std::vector<std::uint32_t>& cells) {
  std::fill(seen_.begin(), seen_.end(), std::uint8_t{0});
  for (const std::uint32_t cell : cells) {
    seen_[cell] = 1;
  }
  const auto bridge = [&](int x, int y, int dx, int dy) {
    std::size_t before = depth.cell(x, y);
    for (int gap = 1; gap <= kWidestGap + 1; ++gap) {
      x += dx;
      y += dy;
      if (x > range.x1 || y > range.y1) {
        return;
      }
      const std::size_t cell = depth.cell(x, y);
      if (!is_one_surface(depth[before], depth[cell])) {
        return;
      }
      if (seen_[cell] == 1) {
        for (int back = 1; back < gap; ++back) {
          const std::size_t between = depth.cell(x - back * dx, y - back * dy);
          if (seen_[between] == 0) {
            seen_[between] = 2;  // no end of another gap
            cells.push_back(static_cast<std::uint32_t>(between));
          }
        }
        return;
      }
      if (is_background_[cell] == 0) {
        return;
      }
      before = cell;
    }
  };
  for (int y = range.y0; y <= range.y1; ++y) {
    for (int x = range.x0; x <= range.x1; ++x) {
      if (seen_[depth.cell(x, y)] == 1) {
        bridge(x, y, 1, 0);
        bridge(x, y, 0, 1);
      }
    }
  }
}

void PersonSegmentation::grow(const DepthGrid& depth, const Range& range, const Cluster& person,
                              std::vector<std::uint32_t>& cells) {
  std::fill(seen_.begin(), seen_.end(), std::uint8_t{0});
  const float seed_reach_m = std::clamp(2.0F * person.deviation_m, 0.15F, kBodyDepth_m);
  float largest = 0;
  float kept = 0;
  for (const Sample& seed : samples_) {
    if (seen_[seed.cell] != 0 || std::abs(seed.depth_m - person.depth_m) > seed_reach_m) {
      continue;
    }
    queue_.assign(1, seed.cell);
    seen_[seed.cell] = 1;
    for (std::size_t next = 0; next < queue_.size(); ++next) {
      const std::size_t from = queue_[next];
      depth.for_each_beside(from, [&](std::size_t to) {
        const int x = static_cast<int>(to) % columns_;
        const int y = static_cast<int>(to) / columns_;
        if (seen_[to] == 0 && is_background_[to] == 0 && x >= range.x0 && x <= range.x1 && y >= range.y0 && y <= range.y1 &&
            std::abs(depth[to] - person.depth_m) < kBodyDepth_m && is_one_surface(depth[from], depth[to])) {
          seen_[to] = 1;
          queue_.push_back(static_cast<std::uint32_t>(to));
        }
      });
    }
    float weight = 0;
    for (const std::uint32_t cell : queue_) {
      weight += weights_[cell];
    }
    if (weight < kLeastPieceShare * largest) {
      continue;
    }
    if (kept < kLeastPieceShare * weight) {
      cells.clear();  // what was found before is crumbs beside this
      kept = 0;
    }
    largest = std::max(largest, weight);
    kept += weight;
    cells.insert(cells.end(), queue_.begin(), queue_.end());
  }
  close_over_planes(depth, range, cells);
  std::sort(cells.begin(), cells.end());
}

void PersonSegmentation::segment(const DepthGrid& depth, const BoundingBox& box, std::vector<std::uint32_t>& cells) {
  cells.clear();
  find_background(depth, box);
  collect(depth, cells_of(box, 0));
  if (samples_.empty()) {
    return;
  }
  std::sort(samples_.begin(), samples_.end(),
            [](const Sample& a, const Sample& b) { return a.depth_m != b.depth_m ? a.depth_m < b.depth_m : a.cell < b.cell; });
  grow(depth, cells_of(box, kGrowMargin), person_cluster(), cells);
}

}  // namespace posed
