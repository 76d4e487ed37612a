#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <tuple>
#include <vector>

#include "core/detections.h"

/// Orders in which boxes are matched and reported. Nothing of it allocates. Reentrant.
namespace posed {

/// A detection and whom it may be: a detection of another look, or somebody remembered.
struct BoxPair {
  float strength;  ///< how well they go together
  std::size_t first;
  std::size_t second;
};

/// For greedy matching. Pairs as strong as each other keep the order of what they are made of: the same boxes match alike always.
inline void order_by_strength(std::vector<BoxPair>& pairs) {
  std::sort(pairs.begin(), pairs.end(), [](const BoxPair& a, const BoxPair& b) {
    return std::tuple(-a.strength, a.first, a.second) < std::tuple(-b.strength, b.first, b.second);
  });
}

/// As `Detections` has them; those as confident as each other stay in their order. By insertion: they are few, and std::stable_sort
/// allocates.
inline void order_by_confidence(std::span<Detection> detections) {
  for (auto next = detections.begin(); next != detections.end(); ++next) {
    const auto is_surer = [](const Detection& a, const Detection& b) { return a.score > b.score; };
    std::rotate(std::upper_bound(detections.begin(), next, *next, is_surer), next, next + 1);
  }
}

}  // namespace posed
