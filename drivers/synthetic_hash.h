#pragma once

#include <cstdint>

/// Randomness of the synthetic source: pure functions of integers, so that a result depends neither on the order of evaluation nor
/// on the machine. All reentrant.
namespace posed {

/// Bijective mixing of 32 bits: the finaliser of MurmurHash3 (Appleby, public domain).
constexpr std::uint32_t hash32(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x85ebca6bU;
  x ^= x >> 13;
  x *= 0xc2b2ae35U;
  x ^= x >> 16;
  return x;
}

constexpr std::uint32_t hash32(std::uint32_t a, std::uint32_t b) {
  return hash32(a ^ (hash32(b) + 0x9e3779b9U));
}

constexpr std::uint32_t hash32(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  return hash32(hash32(a, b), c);
}

/// A stream of numbers out of a seed: the hash of a counter.
class HashRng {
 public:
  constexpr explicit HashRng(std::uint32_t seed) : seed_(hash32(seed ^ 0x51ed270bU)) {}

  constexpr std::uint32_t next() { return hash32(seed_, counter_++); }

  /// Uniform in [0, 1), a multiple of 2^-24, so exact in float.
  constexpr float uniform() { return static_cast<float>(next() >> 8) * 0x1p-24F; }
  constexpr float uniform(float low, float high) { return low + (high - low) * uniform(); }

  /// Uniform in [0, count); the bias of at most count / 2^32 does not matter here.
  constexpr std::uint32_t index(std::uint32_t count) {
    return static_cast<std::uint32_t>((static_cast<std::uint64_t>(next()) * count) >> 32);
  }

 private:
  std::uint32_t seed_;
  std::uint32_t counter_ = 0;
};

}  // namespace posed
