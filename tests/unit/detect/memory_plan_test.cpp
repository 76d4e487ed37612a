#include "detect/memory_plan.h"

#include <cstddef>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace posed {
namespace {

bool overlap(std::size_t a, std::size_t a_bytes, std::size_t b, std::size_t b_bytes) {
  return a < b + b_bytes && b < a + a_bytes;
}

TEST(MemoryPlan, ReusesWhatIsNoLongerNeeded) {
  // A chain: each step reads the last buffer and writes the next, so two are enough for five.
  std::vector<BufferLifetime> chain;
  for (std::size_t step = 0; step < 5; ++step) {
    chain.push_back({1000, step, step + 1});
  }
  EXPECT_EQ(plan_memory(chain).bytes, 2U * 1024);
}

TEST(MemoryPlan, FillsAGapBelow) {
  const std::vector<BufferLifetime> buffers{{4096, 0, 9}, {2048, 0, 3}, {1024, 4, 9}, {1024, 5, 9}};
  EXPECT_EQ(plan_memory(buffers).bytes, 4096U + 2048U);
}

TEST(MemoryPlan, OfNothingIsNothing) {
  EXPECT_EQ(plan_memory({}).bytes, 0U);
}

TEST(MemoryPlan, KeepsLivingBuffersApart) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<BufferLifetime> buffers(random() % 40);
    for (BufferLifetime& buffer : buffers) {
      const std::size_t first = random() % 20;
      buffer = {random() % 5000, first, first + random() % 8};
    }
    const MemoryPlan plan = plan_memory(buffers);
    for (std::size_t a = 0; a < buffers.size(); ++a) {
      ASSERT_EQ(plan.offsets[a] % kBufferAlignment, 0U);
      ASSERT_LE(plan.offsets[a] + buffers[a].bytes, plan.bytes);
      for (std::size_t b = 0; b < a; ++b) {
        const bool together = buffers[a].first_step <= buffers[b].last_step && buffers[b].first_step <= buffers[a].last_step;
        ASSERT_FALSE(together && overlap(plan.offsets[a], buffers[a].bytes, plan.offsets[b], buffers[b].bytes));
      }
    }
  }
}

}  // namespace
}  // namespace posed
