#include "slam/orb_quadtree.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace posed {
namespace {

constexpr int kRadixBits = 10;
constexpr std::size_t kRadix = std::size_t{1} << kRadixBits;

// Bits of the Morton code: bit i goes to bit 2 i.
std::uint32_t spread_bits(std::uint32_t value) {
  std::uint32_t spread = 0;
  for (int bit = 0; bit < 16; ++bit) {
    spread |= (value >> bit & 1u) << (2 * bit);
  }
  return spread;
}

}  // namespace

CornerQuadtree::CornerQuadtree(int width, int height, int border, int max_selected)
    : column_codes_(static_cast<std::size_t>(width)), row_codes_(static_cast<std::size_t>(height)) {
  // Root cells about as wide as high, side by side.
  constexpr std::uint32_t kLeaves = 1u << kDepth;
  const int region_width = std::max(width - 2 * border, 1);
  const int region_height = std::max(height - 2 * border, 1);
  const long roots = std::lround(static_cast<double>(region_width) / region_height);
  roots_ = static_cast<std::uint32_t>(std::clamp(roots, 1L, 15L));
  for (int x = 0; x < region_width && x + border < width; ++x) {
    const std::uint32_t leaf = static_cast<std::uint32_t>(x) * roots_ * kLeaves / static_cast<std::uint32_t>(region_width);
    column_codes_[static_cast<std::size_t>(x + border)] = (leaf / kLeaves) << (2 * kDepth) | spread_bits(leaf % kLeaves);
  }
  for (int y = 0; y < region_height && y + border < height; ++y) {
    const std::uint32_t leaf = static_cast<std::uint32_t>(y) * kLeaves / static_cast<std::uint32_t>(region_height);
    row_codes_[static_cast<std::size_t>(y + border)] = spread_bits(leaf) << 1;
  }
  entries_.reserve(CornerDetector::max_corners(width, height));
  sort_buffer_.reserve(CornerDetector::max_corners(width, height));
  const std::size_t most_cells = static_cast<std::size_t>(max_selected) + kMostExcess;
  cells_.reserve(most_cells);
  splittable_.reserve(most_cells);
}

// Radix sort by the code, least significant digit first; it is stable, so entries of equal code stay in reading order.
void CornerQuadtree::sort_entries(const std::vector<Corner>& corners) {
  std::array<std::uint32_t, kRadix> low_starts{};
  std::array<std::uint32_t, kRadix> high_starts{};
  entries_.resize(corners.size());
  sort_buffer_.resize(corners.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const std::uint32_t code = column_codes_[corners[i].x] | row_codes_[corners[i].y];
    entries_[i] = {code, static_cast<std::uint32_t>(i)};
    ++low_starts[code % kRadix];
    ++high_starts[code / kRadix];
  }
  std::uint32_t low_sum = 0;
  std::uint32_t high_sum = 0;
  for (std::size_t digit = 0; digit < kRadix; ++digit) {
    low_sum += low_starts[digit];
    low_starts[digit] = low_sum - low_starts[digit];
    high_sum += high_starts[digit];
    high_starts[digit] = high_sum - high_starts[digit];
  }
  for (const Entry& entry : entries_) {
    sort_buffer_[low_starts[entry.code % kRadix]++] = entry;
  }
  for (const Entry& entry : sort_buffer_) {
    entries_[high_starts[entry.code / kRadix]++] = entry;
  }
}

void CornerQuadtree::make_roots() {
  cells_.clear();
  std::uint32_t begin = 0;
  const auto size = static_cast<std::uint32_t>(entries_.size());
  while (begin < size) {
    const std::uint32_t root = entries_[begin].code >> (2 * kDepth);
    std::uint32_t end = begin + 1;
    while (end < size && entries_[end].code >> (2 * kDepth) == root) {
      ++end;
    }
    cells_.push_back({begin, end, 0});
    begin = end;
  }
}

// Replaces a cell by those of its four quarters that hold corners: the first in its place, the others at the end.
void CornerQuadtree::split(std::size_t cell) {
  const Cell parent = cells_[cell];
  const int shift = 2 * (kDepth - 1 - parent.depth);
  bool first = true;
  std::uint32_t begin = parent.begin;
  while (begin < parent.end) {
    const std::uint32_t prefix = entries_[begin].code >> shift;
    const auto after = std::partition_point(entries_.begin() + begin, entries_.begin() + parent.end,
                                            [&](const Entry& entry) { return entry.code >> shift == prefix; });
    const auto end = static_cast<std::uint32_t>(after - entries_.begin());
    const Cell child{begin, end, parent.depth + 1};
    if (first) {
      cells_[cell] = child;
    } else {
      cells_.push_back(child);
    }
    first = false;
    begin = end;
  }
}

void CornerQuadtree::grow(std::size_t wanted) {
  while (cells_.size() < wanted) {
    splittable_.clear();
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      if (cells_[i].can_split()) {
        splittable_.push_back(static_cast<std::uint32_t>(i));
      }
    }
    if (splittable_.empty()) {
      return;
    }
    if (cells_.size() + 3 * splittable_.size() > wanted) {
      // The last splits go to the cells that hold most corners.
      std::sort(splittable_.begin(), splittable_.end(), [&](std::uint32_t a, std::uint32_t b) {
        return cells_[a].size() != cells_[b].size() ? cells_[a].size() > cells_[b].size() : cells_[a].begin < cells_[b].begin;
      });
    }
    for (const std::uint32_t cell : splittable_) {
      split(cell);
      if (cells_.size() >= wanted) {
        return;
      }
    }
  }
}

void CornerQuadtree::select(const std::vector<Corner>& corners, int wanted, std::vector<Corner>& selected) {
  selected.clear();
  if (wanted <= 0) {
    return;
  }
  if (corners.size() <= static_cast<std::size_t>(wanted)) {
    selected.assign(corners.begin(), corners.end());
  } else {
    sort_entries(corners);
    make_roots();
    grow(static_cast<std::size_t>(wanted));
    for (const Cell& cell : cells_) {
      const Corner* strongest = &corners[entries_[cell.begin].corner];
      for (std::uint32_t i = cell.begin + 1; i < cell.end; ++i) {
        const Corner& corner = corners[entries_[i].corner];
        if (corner.score > strongest->score) {
          strongest = &corner;
        }
      }
      selected.push_back(*strongest);
    }
  }
  std::sort(selected.begin(), selected.end(), [](const Corner& a, const Corner& b) { return a.y != b.y ? a.y < b.y : a.x < b.x; });
}

}  // namespace posed
