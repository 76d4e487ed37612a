#include "slam/mover_labels.h"

#include <algorithm>
#include <cmath>

#include "slam/free_space.h"
#include "slam/surface.h"

namespace posed {

MoverCarrier::MoverCarrier(const PinholeCamera& camera) : camera_(camera) {
  const DepthGrid grid(camera.intrinsics().width, camera.intrinsics().height);
  front_.reserve(grid.size());
  next_front_.reserve(grid.size());
  seen_.assign(grid.size(), 0);
  hole_.reserve(grid.size());
}

void MoverCarrier::carry(const DepthGrid& from, std::span<const std::uint8_t> labels_from, const Se3& T_to_from,
                         const MoverReach& reach, const DepthGrid& to, std::span<std::uint8_t> labels_to) {
  std::fill(labels_to.begin(), labels_to.end(), std::uint8_t{0});
  const Eigen::Matrix3f R = T_to_from.rotation_matrix().cast<float>();
  const Eigen::Vector3f t = T_to_from.translation().cast<float>();
  for (std::size_t cell = 0; cell < from.size(); ++cell) {
    if (labels_from[cell] == 0 || from[cell] <= 0) {
      continue;
    }
    const Eigen::Vector3f p = R * camera_.point(cell, from[cell]) + t;
    const int there = camera_.cell_of(p);
    if (there == GridCamera::kOutside) {
      continue;
    }
    const auto c = static_cast<std::size_t>(there);
    if (to[c] > 0 && std::abs(to[c] - p.z()) < depth_tolerance_m(p.z())) {
      labels_to[c] = std::max(labels_to[c], labels_from[cell]);  // of two that meet the same one wins, whatever the order
    }
  }
  close_seams(to, labels_to);
  grow(to, reach, labels_to);
  fill_holes(to, labels_to);
}

/// A surface that comes nearer leaves lines of cells out between those it is carried to.
void MoverCarrier::close_seams(const DepthGrid& to, std::span<std::uint8_t> labels_to) {
  const auto columns = static_cast<std::size_t>(to.columns());
  const auto shared = [&](std::size_t a, std::size_t cell, std::size_t b) {
    const bool one = labels_to[a] != 0 && mover_of(labels_to[a]) == mover_of(labels_to[b]) && is_one_surface(to[a], to[cell]) &&
                     is_one_surface(to[cell], to[b]);
    return one ? std::min(labels_to[a], labels_to[b]) : std::uint8_t{0};
  };
  for (std::size_t cell = columns + 1; cell + columns + 1 < labels_to.size(); ++cell) {
    if (labels_to[cell] == 0) {
      const std::uint8_t label = std::max(shared(cell - 1, cell, cell + 1), shared(cell - columns, cell, cell + columns));
      labels_to[cell] = label;
    }
  }
}

void MoverCarrier::grow(const DepthGrid& to, const MoverReach& reach, std::span<std::uint8_t> labels_to) {
  front_.clear();
  for (std::size_t cell = 0; cell < labels_to.size(); ++cell) {
    if (labels_to[cell] != 0) {
      front_.push_back(static_cast<std::uint32_t>(cell));
    }
  }
  const int most = *std::max_element(reach.begin(), reach.end());
  for (int step = 0; step < most; ++step) {
    next_front_.clear();
    for (const std::uint32_t cell : front_) {
      if (step >= reach[mover_of(labels_to[cell])]) {
        continue;
      }
      to.for_each_beside(cell, [&](std::size_t beside) {
        if (labels_to[beside] == 0 && is_one_surface(to[cell], to[beside])) {
          labels_to[beside] = mover_of(labels_to[cell]);
          next_front_.push_back(static_cast<std::uint32_t>(beside));
        }
      });
    }
    std::swap(front_, next_front_);
  }
}

void MoverCarrier::fill_holes(const DepthGrid& depth, std::span<std::uint8_t> labels) {
  constexpr int kLeastAround = 4;
  std::fill(seen_.begin(), seen_.end(), std::uint8_t{0});
  for (std::size_t first = 0; first < labels.size(); ++first) {
    if (seen_[first] != 0 || labels[first] != 0 || depth[first] > 0) {
      continue;
    }
    hole_.assign(1, static_cast<std::uint32_t>(first));
    seen_[first] = 1;
    std::size_t border = 0;
    std::size_t movers = 0;
    std::uint8_t label = 0;
    for (std::size_t next = 0; next < hole_.size(); ++next) {
      depth.for_each_beside(hole_[next], [&](std::size_t to) {
        if (labels[to] == 0 && depth[to] <= 0) {
          if (seen_[to] == 0) {
            seen_[to] = 1;
            hole_.push_back(static_cast<std::uint32_t>(to));
          }
          return;
        }
        ++border;
        movers += labels[to] != 0 ? 1 : 0;
        label = std::max(label, labels[to]);
      });
    }
    if (2 * movers >= border && movers > 0) {
      for (const std::uint32_t cell : hole_) {
        labels[cell] = label;
      }
      continue;
    }
    std::size_t count = 0;  // of the hole's cells that are filled; they move to its front, and get their labels once all are known
    for (std::size_t i = 0; i < hole_.size() && movers > 0; ++i) {
      int around = 0;
      std::uint8_t beside = 0;
      depth.for_each_around(hole_[i], [&](std::size_t c) {
        around += labels[c] != 0 ? 1 : 0;
        beside = std::max(beside, labels[c]);
      });
      if (around >= kLeastAround) {
        seen_[hole_[i]] = beside;
        std::swap(hole_[count++], hole_[i]);
      }
    }
    for (std::size_t i = 0; i < count; ++i) {
      labels[hole_[i]] = seen_[hole_[i]];
    }
  }
}

}  // namespace posed
