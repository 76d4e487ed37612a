#include "slam/person_segmentation.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "slam/surface.h"

namespace posed {

namespace {

constexpr int kClusters = 3;
constexpr int kIterations = 6;
constexpr float kOneSurface_m = 0.25F;       // clusters nearer to each other than this are one
constexpr float kLeastShare = 0.25F;         // of the box's weight, that the nearest cluster must have to be the person
constexpr float kBodyDepth_m = 0.45F;        // half of it: how far a body reaches from its middle, arms included
constexpr float kGrowMargin = 0.12F;         // of the box's sides, how far a person may reach beyond it
constexpr std::size_t kLeastPieceShare = 8;  // a piece of less than one part in so many of the largest one is not the person's

}  // namespace

PersonSegmentation::PersonSegmentation(int image_width, int image_height) {
  const DepthGrid grid(image_width, image_height);
  columns_ = grid.columns();
  rows_ = grid.rows();
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

void PersonSegmentation::collect(const DepthGrid& depth, const Range& range) {
  samples_.clear();
  const float half_width = 0.5F * static_cast<float>(range.x1 - range.x0 + 1);
  const float half_height = 0.5F * static_cast<float>(range.y1 - range.y0 + 1);
  for (int y = range.y0; y <= range.y1; ++y) {
    for (int x = range.x0; x <= range.x1; ++x) {
      const std::size_t cell = depth.cell(x, y);
      if (depth[cell] > 0) {
        const float off_x = std::abs(static_cast<float>(x - range.x0) + 0.5F - half_width) / half_width;
        const float off_y = std::abs(static_cast<float>(y - range.y0) + 0.5F - half_height) / half_height;
        samples_.push_back({static_cast<std::uint32_t>(cell), depth[cell], (1.05F - off_x) * (1.25F - off_y)});
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

void PersonSegmentation::grow(const DepthGrid& depth, const Range& range, const Cluster& person,
                              std::vector<std::uint32_t>& cells) {
  std::fill(seen_.begin(), seen_.end(), std::uint8_t{0});
  const float seed_reach_m = std::clamp(2.0F * person.deviation_m, 0.15F, kBodyDepth_m);
  std::size_t largest = 0;
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
        if (seen_[to] == 0 && x >= range.x0 && x <= range.x1 && y >= range.y0 && y <= range.y1 &&
            std::abs(depth[to] - person.depth_m) < kBodyDepth_m && is_one_surface(depth[from], depth[to])) {
          seen_[to] = 1;
          queue_.push_back(static_cast<std::uint32_t>(to));
        }
      });
    }
    if (kLeastPieceShare * queue_.size() < largest) {
      continue;
    }
    if (kLeastPieceShare * cells.size() < queue_.size()) {
      cells.clear();  // what was found before is crumbs beside this
    }
    largest = std::max(largest, queue_.size());
    cells.insert(cells.end(), queue_.begin(), queue_.end());
  }
  std::sort(cells.begin(), cells.end());
}

void PersonSegmentation::segment(const DepthGrid& depth, const BoundingBox& box, std::vector<std::uint32_t>& cells) {
  cells.clear();
  collect(depth, cells_of(box, 0));
  if (samples_.empty()) {
    return;
  }
  std::sort(samples_.begin(), samples_.end(),
            [](const Sample& a, const Sample& b) { return a.depth_m != b.depth_m ? a.depth_m < b.depth_m : a.cell < b.cell; });
  grow(depth, cells_of(box, kGrowMargin), person_cluster(), cells);
}

}  // namespace posed
