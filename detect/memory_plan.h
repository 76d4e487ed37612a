#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace posed {

/// A buffer that is needed from one step to another, both included.
struct BufferLifetime {
  std::size_t bytes = 0;
  std::size_t first_step = 0;
  std::size_t last_step = 0;
};

struct MemoryPlan {
  std::vector<std::size_t> offsets;  ///< of each buffer, multiples of kBufferAlignment
  std::size_t bytes = 0;
};

constexpr std::size_t kBufferAlignment = 64;

/// Places buffers into one block so that no two that are needed at the same time overlap: largest first, each at the lowest offset
/// that is free for all of its life (greedy by size; Pisarchyk and Lee, "Efficient memory management for deep neural net
/// inference", 2020). Reentrant.
MemoryPlan plan_memory(std::span<const BufferLifetime> buffers);

}  // namespace posed
