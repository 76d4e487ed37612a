#pragma once

#include <cstdint>
#include <span>

namespace posed {

/// Instruction sets for which the kernels are compiled. The results are bit-identical on all of them; only the speed differs.
enum class SimdLevel : std::uint8_t {
  Baseline,  ///< what the target architecture guarantees: SSE2 on x86-64, NEON on 64-bit Arm
  Avx2,      ///< AVX2, BMI and POPCNT
  Avx512,    ///< AVX-512 F, BW, CD, DQ and VL (Skylake-X, Zen 4 and later)
};

/// Those that this build contains and this processor runs, slowest first; never empty. Reentrant.
std::span<const SimdLevel> supported_simd_levels();

/// The last, that is the fastest, of `supported_simd_levels()`.
SimdLevel best_simd_level();

const char* to_string(SimdLevel level);

}  // namespace posed
