#pragma once

#include <cstdint>

#include "core/result.h"

namespace posed {

/// Keeps all memory of the process, present and future, in RAM, so that no page fault delays a thread: mlockall, and the allocator
/// told to give nothing back to the system. Thread stacks started later are there from their first byte. Error Unavailable, and
/// nothing is locked, where the limit on locked memory is not infinite and the process may not exceed it: under such a limit later
/// allocations would fail. Call it once, before threads start.
Status lock_memory();

/// Page faults of the calling thread so far, both those that read a disk and those that did not. Reentrant.
std::uint64_t thread_page_faults() noexcept;

}  // namespace posed
