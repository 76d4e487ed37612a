#pragma once

#include <mutex>

#include "core/thread_annotations.h"

namespace posed {

/// std::mutex that clang's thread-safety analysis understands. Not for the capture and tracking threads, which take no lock. To
/// wait for a condition use std::condition_variable_any, which takes a `Mutex` as it is. Thread-safe.
class POSED_CAPABILITY("mutex") Mutex {
 public:
  void lock() POSED_ACQUIRE() { mutex_.lock(); }
  void unlock() POSED_RELEASE() { mutex_.unlock(); }
  [[nodiscard]] bool try_lock() POSED_TRY_ACQUIRE(true) { return mutex_.try_lock(); }

 private:
  std::mutex mutex_;
};

/// Holds a `Mutex` while it lives. Thread-bound: a local variable of the thread that locks.
class [[nodiscard]] POSED_SCOPED_CAPABILITY MutexLock {
 public:
  explicit MutexLock(Mutex& mutex) POSED_ACQUIRE(mutex) : mutex_(mutex) { mutex_.lock(); }
  ~MutexLock() POSED_RELEASE() { mutex_.unlock(); }
  MutexLock(const MutexLock&) = delete;
  MutexLock& operator=(const MutexLock&) = delete;

 private:
  Mutex& mutex_;
};

}  // namespace posed
