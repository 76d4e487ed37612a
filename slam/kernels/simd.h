#pragma once

/// OpenCV's universal intrinsics for the instruction set that this translation unit is compiled for. Only for the kernel sources,
/// each of which is compiled once for each instruction set; include it before anything else.
///
/// One definition rule: OpenCV puts its inline functions into a namespace named after CV_CPU_DISPATCH_MODE, and the kernels' own
/// functions have internal linkage, so that the linker never hands AVX code to a caller that was compiled without. For the same
/// reason kernel sources use no templates and no inline functions of the standard library.

#if defined(__x86_64__) && defined(__AVX2__)
#include <immintrin.h>
#define CV_SSE3 1
#define CV_SSSE3 1
#define CV_SSE4_1 1
#define CV_SSE4_2 1
#define CV_POPCNT 1
#define CV_AVX 1
#define CV_AVX2 1
#if defined(__AVX512BW__) && defined(__AVX512VL__) && defined(__AVX512DQ__) && defined(__AVX512CD__)
#define CV_AVX_512F 1
#define CV_AVX512_COMMON 1
#define CV_AVX512_SKX 1
#define CV_CPU_DISPATCH_MODE AVX512_SKX
#define POSED_KERNELS_AVX512 1
#else
#define CV_CPU_DISPATCH_MODE AVX2
#define POSED_KERNELS_AVX2 1
#endif
#endif

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#include <opencv2/core/hal/intrin.hpp>
#pragma GCC diagnostic pop
