#include "core/simd_level.h"

#include <array>
#include <cstddef>

namespace posed {
namespace {

struct SupportedLevels {
  std::array<SimdLevel, 3> levels{};
  std::size_t count = 0;

  SupportedLevels() {
    levels[count++] = SimdLevel::Baseline;
#ifdef __x86_64__
    __builtin_cpu_init();
    if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("bmi") || !__builtin_cpu_supports("popcnt")) {
      return;
    }
    levels[count++] = SimdLevel::Avx2;
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512cd") &&
        __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl")) {
      levels[count++] = SimdLevel::Avx512;
    }
#endif
  }
};

}  // namespace

std::span<const SimdLevel> supported_simd_levels() {
  static const SupportedLevels supported;
  return {supported.levels.data(), supported.count};
}

SimdLevel best_simd_level() {
  return supported_simd_levels().back();
}

const char* to_string(SimdLevel level) {
  switch (level) {
    case SimdLevel::Baseline: return "baseline";
    case SimdLevel::Avx2: return "avx2";
    case SimdLevel::Avx512: return "avx512";
  }
  return "unknown";
}

}  // namespace posed
