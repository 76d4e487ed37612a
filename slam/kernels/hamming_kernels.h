#pragma once

#include "slam/hamming.h"

namespace posed::kernels {

extern const HammingKernels kHammingBaseline;
#ifdef __x86_64__
extern const HammingKernels kHammingAvx2;
extern const HammingKernels kHammingAvx512;
#endif

}  // namespace posed::kernels
