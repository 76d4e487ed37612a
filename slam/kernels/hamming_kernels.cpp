// Compiled once for each instruction set.
#include "slam/kernels/simd.h"

// The universal intrinsics come first: they are configured by the instruction set.
#include "slam/kernels/hamming_kernels.h"

namespace posed::kernels {
namespace {

#if defined(__POPCNT__)

inline std::uint16_t distance(const std::uint64_t* a, const std::uint64_t* b) {
  return static_cast<std::uint16_t>(__builtin_popcountll(a[0] ^ b[0]) + __builtin_popcountll(a[1] ^ b[1]) +
                                    __builtin_popcountll(a[2] ^ b[2]) + __builtin_popcountll(a[3] ^ b[3]));
}

#else

// Without a scalar population count (baseline x86-64; on Arm it lives in the vector unit) bytes are counted 16 at a time.
inline std::uint16_t distance(const std::uint64_t* a, const std::uint64_t* b) {
  const auto* a_bytes = reinterpret_cast<const std::uint8_t*>(a);
  const auto* b_bytes = reinterpret_cast<const std::uint8_t*>(b);
  const cv::v_uint8x16 low = cv::v_popcount(cv::v_load(a_bytes) ^ cv::v_load(b_bytes));
  const cv::v_uint8x16 high = cv::v_popcount(cv::v_load(a_bytes + 16) ^ cv::v_load(b_bytes + 16));
  return static_cast<std::uint16_t>(cv::v_reduce_sum(low + high));
}

#endif

// Descriptors are taken by their words: an inline function of std::array, compiled here, could end up in code for another
// processor.
inline const std::uint64_t* words(const Descriptor* descriptor) {
  return reinterpret_cast<const std::uint64_t*>(descriptor);
}

void distances_indexed(const Descriptor& query, const Descriptor* base, const std::uint16_t* indices, int count,
                       std::uint16_t* out) {
  const std::uint64_t* query_words = words(&query);
  for (int i = 0; i < count; ++i) {
    out[i] = distance(query_words, words(base + indices[i]));
  }
}

void distances(const Descriptor& query, const Descriptor* base, int count, std::uint16_t* out) {
  const std::uint64_t* query_words = words(&query);
  for (int i = 0; i < count; ++i) {
    out[i] = distance(query_words, words(base + i));
  }
}

}  // namespace

#if defined(POSED_KERNELS_AVX512)
const HammingKernels kHammingAvx512{distances_indexed, distances};
#elif defined(POSED_KERNELS_AVX2)
const HammingKernels kHammingAvx2{distances_indexed, distances};
#else
const HammingKernels kHammingBaseline{distances_indexed, distances};
#endif

}  // namespace posed::kernels
