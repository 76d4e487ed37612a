#include <array>

#include "slam/kernels/orb_kernels.h"

namespace posed {
namespace {

// Rows of the disc of radius 15: the largest half width w with v^2 + w^2 <= 15.5^2.
constexpr std::array<int, kPatchRadius + 1> make_half_widths() {
  std::array<int, kPatchRadius + 1> half_widths{};
  constexpr int kFourRadiusSquared = (2 * kPatchRadius + 1) * (2 * kPatchRadius + 1);
  for (int v = 0; v <= kPatchRadius; ++v) {
    int w = kPatchRadius;
    while (4 * (v * v + w * w) > kFourRadiusSquared) {
      --w;
    }
    half_widths[static_cast<std::size_t>(v)] = w;
  }
  return half_widths;
}

constexpr std::array<int, kPatchRadius + 1> kHalfWidths = make_half_widths();

constexpr kernels::DiscMask make_disc_mask() {
  kernels::DiscMask mask{};
  for (std::size_t v = 0; v < kHalfWidths.size(); ++v) {
    for (int u = -kHalfWidths[v]; u <= kHalfWidths[v]; ++u) {
      mask.row[v][u + kPatchRadius] = 0xffff;
    }
  }
  return mask;
}

}  // namespace

namespace kernels {
const DiscMask kDiscMask = make_disc_mask();
}

int disc_half_width(int v) {
  return kHalfWidths[static_cast<std::size_t>(v < 0 ? -v : v)];
}

const OrbKernels& orb_kernels(SimdLevel level) {
  switch (level) {
#ifdef __x86_64__
    case SimdLevel::Avx512: return kernels::kOrbAvx512;
    case SimdLevel::Avx2: return kernels::kOrbAvx2;
#endif
    default: return kernels::kOrbBaseline;
  }
}

}  // namespace posed
