#include <array>

#include "detect/kernels/tensor_kernels.h"

namespace posed {

extern const TensorKernels kTensorKernelsBaseline;
#ifdef POSED_KERNELS_X86
extern const TensorKernels kTensorKernelsAvx2;
extern const TensorKernels kTensorKernelsAvx512;
#endif

namespace {

struct SupportedKernels {
  std::array<const TensorKernels*, 3> tables{};
  std::size_t count = 0;

  SupportedKernels() {
    tables[count++] = &kTensorKernelsBaseline;
#ifdef POSED_KERNELS_X86
    __builtin_cpu_init();
    if (!__builtin_cpu_supports("avx2")) {
      return;
    }
    tables[count++] = &kTensorKernelsAvx2;
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl")) {
      tables[count++] = &kTensorKernelsAvx512;
    }
#endif
  }
};

}  // namespace

std::span<const TensorKernels* const> supported_tensor_kernels() {
  static const SupportedKernels supported;
  return {supported.tables.data(), supported.count};
}

const TensorKernels& tensor_kernels() {
  return *supported_tensor_kernels().back();
}

}  // namespace posed
