#pragma once

#include <bit>

#include "slam/features.h"

namespace posed {

/// Number of bits in which two descriptors differ, 0 to 256. For single pairs; `HammingKernels` compares many at a time. Reentrant.
inline int hamming_distance(const Descriptor& a, const Descriptor& b) noexcept {
  int distance = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    distance += std::popcount(a[i] ^ b[i]);
  }
  return distance;
}

}  // namespace posed
