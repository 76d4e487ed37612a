#include "detect/half.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace posed {
namespace {

constexpr int kInfiniteExponent = 0x1F;
constexpr std::uint16_t kInfinity = 0x7C00;

}  // namespace

float half_to_float(std::uint16_t half) {
  const int exponent = (half >> 10) & kInfiniteExponent;
  const int fraction = half & 0x3FF;
  const float sign = (half & 0x8000) != 0 ? -1.0F : 1.0F;
  if (exponent == kInfiniteExponent) {
    return fraction == 0 ? sign * std::numeric_limits<float>::infinity() : std::numeric_limits<float>::quiet_NaN();
  }
  const float significand = static_cast<float>(exponent == 0 ? fraction : fraction + 1024);
  return sign * std::ldexp(significand, (exponent == 0 ? 1 : exponent) - 25);
}

std::uint16_t float_to_half(float value) {
  const auto sign = static_cast<std::uint16_t>((std::bit_cast<std::uint32_t>(value) >> 16) & 0x8000);
  if (std::isnan(value)) {
    return kInfinity | 0x200;
  }
  const float magnitude = std::abs(value);
  if (magnitude >= 65520.0F) {
    return sign | kInfinity;
  }
  if (magnitude == 0) {
    return sign;
  }
  // The half's last bit is worth 2^(exponent - 10), for subnormals 2^-24; nearbyint rounds ties to even.
  const int exponent = std::max(std::ilogb(magnitude), -14);
  const auto steps = static_cast<std::uint32_t>(std::nearbyint(std::ldexp(magnitude, 10 - exponent)));
  // A normal number's steps include the hidden bit, so that adding carries a rounding to the next power of two into the exponent.
  const std::uint32_t bits = steps < 1024 ? steps : (static_cast<std::uint32_t>(exponent + 14) << 10) + steps;
  return static_cast<std::uint16_t>(sign | bits);
}

}  // namespace posed
