#pragma once

#include <cstdint>

#include "slam/features.h"
#include "core/simd_level.h"

namespace posed {

/// Hamming distances (0 to 256) of one descriptor to many, for one instruction set. Reentrant; they neither allocate nor lock.
struct HammingKernels {
  /// out[i] = distance(query, base[indices[i]]) for i in [0, count).
  void (*distances_indexed)(const Descriptor& query, const Descriptor* base, const std::uint16_t* indices, int count,
                            std::uint16_t* out);
  /// out[i] = distance(query, base[i]) for i in [0, count).
  void (*distances)(const Descriptor& query, const Descriptor* base, int count, std::uint16_t* out);
};

/// The kernels of the best instruction set that this processor has. Reentrant; the first call of the program detects the processor,
/// so real-time code fetches the reference beforehand and keeps it.
const HammingKernels& hamming_kernels();

/// The kernels of one instruction set, for tests and benchmarks. `level` must be one of `supported_simd_levels()`.
const HammingKernels& hamming_kernels(SimdLevel level);

}  // namespace posed
