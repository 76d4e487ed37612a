#include "detect/kernels/tensor_kernels.h"

namespace posed {

extern const TensorKernels kTensorKernelsBaseline;
#ifdef POSED_KERNELS_X86
extern const TensorKernels kTensorKernelsAvx2;
extern const TensorKernels kTensorKernelsAvx512;
#endif

const TensorKernels& tensor_kernels() {
#ifdef POSED_KERNELS_X86
  static const bool avx2 = __builtin_cpu_supports("avx2");
  static const bool avx512 = avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                             __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
  if (avx512) {
    return kTensorKernelsAvx512;
  }
  if (avx2) {
    return kTensorKernelsAvx2;
  }
#endif
  return kTensorKernelsBaseline;
}

}  // namespace posed
