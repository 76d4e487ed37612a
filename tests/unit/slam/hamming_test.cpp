#include "slam/hamming.h"

#include <bitset>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "slam/descriptor.h"

namespace posed {
namespace {

std::vector<Descriptor> random_descriptors(std::size_t count) {
  std::mt19937_64 random(7);
  std::vector<Descriptor> descriptors(count);
  for (Descriptor& descriptor : descriptors) {
    for (std::uint64_t& word : descriptor) {
      word = random();
    }
  }
  return descriptors;
}

int distance_bit_by_bit(const Descriptor& a, const Descriptor& b) {
  std::size_t distance = 0;
  for (std::size_t word = 0; word < a.size(); ++word) {
    distance += (std::bitset<64>(a[word]) ^ std::bitset<64>(b[word])).count();
  }
  return static_cast<int>(distance);
}

TEST(Hamming, ExtremesAreZeroAnd256) {
  const Descriptor zeros{};
  const Descriptor ones{~0ull, ~0ull, ~0ull, ~0ull};
  EXPECT_EQ(hamming_distance(zeros, zeros), 0);
  EXPECT_EQ(hamming_distance(zeros, ones), 256);
  for (const SimdLevel level : supported_simd_levels()) {
    std::uint16_t distance = 0;
    hamming_kernels(level).distances(zeros, &ones, 1, &distance);
    EXPECT_EQ(distance, 256) << to_string(level);
  }
}

TEST(Hamming, KernelsCountBitsOnEveryInstructionSet) {
  const std::vector<Descriptor> descriptors = random_descriptors(101);
  std::vector<std::uint16_t> indices;
  for (std::size_t i = 0; i < 57; ++i) {
    indices.push_back(static_cast<std::uint16_t>(i * 40 % descriptors.size()));
  }
  for (const SimdLevel level : supported_simd_levels()) {
    const HammingKernels& kernels = hamming_kernels(level);
    std::vector<std::uint16_t> all(descriptors.size() + 1, 999);
    std::vector<std::uint16_t> some(indices.size() + 1, 999);
    kernels.distances(descriptors[5], descriptors.data(), static_cast<int>(descriptors.size()), all.data());
    kernels.distances_indexed(descriptors[5], descriptors.data(), indices.data(), static_cast<int>(indices.size()), some.data());
    for (std::size_t i = 0; i < descriptors.size(); ++i) {
      EXPECT_EQ(all[i], distance_bit_by_bit(descriptors[5], descriptors[i])) << to_string(level) << " " << i;
      EXPECT_EQ(hamming_distance(descriptors[5], descriptors[i]), all[i]);
    }
    for (std::size_t i = 0; i < indices.size(); ++i) {
      EXPECT_EQ(some[i], all[indices[i]]) << to_string(level) << " " << i;
    }
    EXPECT_EQ(all.back(), 999) << "wrote past the end";
    EXPECT_EQ(some.back(), 999) << "wrote past the end";
  }
}

}  // namespace
}  // namespace posed
