#include "core/mutex.h"

#include <thread>
#include <type_traits>

#include <gtest/gtest.h>

namespace posed {
namespace {

static_assert(!std::is_copy_constructible_v<MutexLock> && !std::is_move_constructible_v<MutexLock>);
static_assert(!std::is_copy_constructible_v<Mutex>);

bool another_thread_can_lock(Mutex& mutex) {
  bool locked = false;
  std::thread([&] {
    if (mutex.try_lock()) {
      locked = true;
      mutex.unlock();
    }
  }).join();
  return locked;
}

TEST(Mutex, IsHeldForTheLifeOfALock) {
  Mutex mutex;
  EXPECT_TRUE(another_thread_can_lock(mutex));
  {
    const MutexLock lock(mutex);
    EXPECT_FALSE(another_thread_can_lock(mutex));
  }
  EXPECT_TRUE(another_thread_can_lock(mutex));
}

TEST(Mutex, ExcludesOtherThreads) {
  Mutex mutex;
  int count = 0;
  const auto increment = [&] {
    for (int i = 0; i < 10'000; ++i) {
      const MutexLock lock(mutex);
      ++count;
    }
  };
  std::thread other(increment);
  increment();
  other.join();
  EXPECT_EQ(count, 20'000);
}

}  // namespace
}  // namespace posed
