#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/se3.h"
#include "slam/depth_grid.h"

namespace posed {

/// One entry a cell: 0, or a mover's number from 1 on, with a flag where a detection said that the cell is a person's.
constexpr std::size_t kMostMovers = 31;
constexpr std::uint8_t kMoverMask = 0x3F;
constexpr std::uint8_t kPersonCore = 0x80;

constexpr std::uint8_t mover_of(std::uint8_t label) {
  return label & kMoverMask;
}

/// For each mover, at its number, by how many cells its edge may move from one frame to the next.
using MoverReach = std::array<std::uint8_t, kMostMovers + 1>;

/// Moves labels from one frame to a later one. Allocates at construction only. Thread-bound.
class MoverCarrier {
 public:
  explicit MoverCarrier(const PinholeCamera& camera);

  /// Replaces `labels_to`. A labelled cell's surface is expected where the camera's motion puts it; the labels found there grow
  /// over connected surface by `reach`, for the mover's own motion, and fill holes in the depth.
  void carry(const DepthGrid& from, std::span<const std::uint8_t> labels_from, const Se3& T_to_from, const MoverReach& reach,
             const DepthGrid& to, std::span<std::uint8_t> labels_to);

  /// Labels cells without depth that lie among those of movers: hair and black cloth swallow the sensor's light. A hole that movers
  /// enclose for the most part is theirs as a whole; of others, such as a dark screen behind a person, only what lies between cells
  /// of a mover is.
  void fill_holes(const DepthGrid& depth, std::span<std::uint8_t> labels);

 private:
  void close_seams(const DepthGrid& to, std::span<std::uint8_t> labels_to);
  void grow(const DepthGrid& to, const MoverReach& reach, std::span<std::uint8_t> labels_to);

  GridCamera camera_;
  std::vector<std::uint32_t> front_;
  std::vector<std::uint32_t> next_front_;
  std::vector<std::uint8_t> seen_;
  std::vector<std::uint32_t> hole_;
};

}  // namespace posed
