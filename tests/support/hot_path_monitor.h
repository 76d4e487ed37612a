#pragma once

#include <initializer_list>
#include <string>

namespace posed::test {

/// What threads did that a real-time thread must not do.
struct HotPathCounts {
  long allocations = 0;     ///< malloc and its kin, operator new among them, and free
  long locks = 0;           ///< pthread mutexes, reader-writer locks, condition variables
  long blocking_calls = 0;  ///< sleeps, reads, writes, polls, file synchronisation; not the futex that waits for the next frame
  std::string first_stack;  ///< where the first of them was called from: module(+offset) a line, for addr2line
};

/// Counts from now on what threads with these names (core/thread.h; at most four) do. The program's own malloc, pthread_mutex_lock
/// and so on stand before the C library's, so whatever any library does on that thread is seen. Linking this file is what installs
/// them.
void watch_hot_path(std::initializer_list<const char*> thread_names);

/// Stops counting and returns the counts.
HotPathCounts hot_path_counts();

}  // namespace posed::test
