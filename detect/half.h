#pragma once

#include <cstdint>

namespace posed {

/// IEEE 754 binary16, by its bits: 11 bits of precision, up to 65504. Reentrant.
float half_to_float(std::uint16_t half);

/// The nearest, ties to even; infinite above 65519.
std::uint16_t float_to_half(float value);

}  // namespace posed
