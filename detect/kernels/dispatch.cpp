#include "detect/kernels/tensor_kernels.h"

namespace posed {

extern const TensorKernels kTensorKernelsBaseline;
#ifdef __x86_64__
extern const TensorKernels kTensorKernelsAvx2;
extern const TensorKernels kTensorKernelsAvx512;
#endif

const TensorKernels& tensor_kernels(SimdLevel level) {
  switch (level) {
#ifdef __x86_64__
    case SimdLevel::Avx512: return kTensorKernelsAvx512;
    case SimdLevel::Avx2: return kTensorKernelsAvx2;
#endif
    default: return kTensorKernelsBaseline;
  }
}

const TensorKernels& tensor_kernels() {
  static const TensorKernels& best = tensor_kernels(best_simd_level());
  return best;
}

}  // namespace posed
