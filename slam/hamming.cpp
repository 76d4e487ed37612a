#include "slam/hamming.h"

#include "slam/kernels/hamming_kernels.h"

namespace posed {

const HammingKernels& hamming_kernels(SimdLevel level) {
  switch (level) {
#ifdef __x86_64__
    case SimdLevel::Avx512: return kernels::kHammingAvx512;
    case SimdLevel::Avx2: return kernels::kHammingAvx2;
#endif
    default: return kernels::kHammingBaseline;
  }
}

const HammingKernels& hamming_kernels() {
  return hamming_kernels(best_simd_level());
}

}  // namespace posed
