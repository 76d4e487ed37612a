#pragma once

#include <cstdint>
#include <vector>

#include "slam/orb_corners.h"

namespace posed {

/// Spreads a number of corners over the image: a quad-tree over the image splits the cells that hold most corners until there are
/// as many cells as corners are wanted, and of each cell the strongest corner is kept. Corners are sorted once along the Morton
/// curve, so that a cell of the tree is a range of the sorted array. Allocates at construction only. Reentrant.
class CornerQuadtree {
 public:
  static constexpr std::size_t kMostExcess = 16;  ///< corners that `select` may return beyond those wanted

  /// For one image size; corners lie in [border, width - border) x [border, height - border). `max_selected`: most that will be
  /// asked for.
  CornerQuadtree(int width, int height, int border, int max_selected);

  /// Replaces `selected` by about `wanted` of `corners` in reading order: all if there are no more, else at least as many
  /// and at most 2 more (or as many as the tree has root cells, up to 15). Equal scores: the first along the curve. `selected` must
  /// have room for wanted + kMostExcess, then nothing is allocated.
  void select(const std::vector<Corner>& corners, int wanted, std::vector<Corner>& selected);

 private:
  static constexpr int kDepth = 8;  ///< of the tree: a cell of the lowest level is 1/256 of a root cell wide

  struct Entry {
    std::uint32_t code;    ///< root cell, then two bits for each level of the tree
    std::uint32_t corner;  ///< index
  };
  struct Cell {
    std::uint32_t begin;  ///< range of the sorted entries
    std::uint32_t end;
    std::int32_t depth;
    std::uint32_t size() const { return end - begin; }
    bool can_split() const { return size() > 1 && depth < kDepth; }
  };

  void sort_entries(const std::vector<Corner>& corners);
  void make_roots();
  void split(std::size_t cell);
  void grow(std::size_t wanted);

  std::vector<std::uint32_t> column_codes_;
  std::vector<std::uint32_t> row_codes_;
  std::uint32_t roots_ = 1;
  std::vector<Entry> entries_;
  std::vector<Entry> sort_buffer_;
  std::vector<Cell> cells_;
  std::vector<std::uint32_t> splittable_;  ///< indices of cells
};

}  // namespace posed
