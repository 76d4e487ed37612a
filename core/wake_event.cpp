#include "core/wake_event.h"

#include <algorithm>
#include <climits>
#include <ctime>
#include <limits>
#include <unistd.h>

#include <linux/futex.h>
#include <sys/syscall.h>

namespace posed {

namespace {

// The kernel reads the word itself, so an atomic must be nothing but its value.
static_assert(sizeof(std::atomic<std::uint32_t>) == sizeof(std::uint32_t) && std::atomic<std::uint32_t>::is_always_lock_free);

long futex(std::atomic<std::uint32_t>& word, int operation, std::uint32_t value, const timespec* timeout) noexcept {
  return syscall(SYS_futex, reinterpret_cast<std::uint32_t*>(&word), operation | FUTEX_PRIVATE_FLAG, value, timeout, nullptr, 0);
}

}  // namespace

void WakeEvent::notify() noexcept {
  // Sequentially consistent on both sides: either this sees the waiter, or the waiter sees the new generation.
  generation_.fetch_add(1, std::memory_order_seq_cst);
  if (waiters_.load(std::memory_order_seq_cst) != 0) {
    futex(generation_, FUTEX_WAKE, INT_MAX, nullptr);
  }
}

bool WakeEvent::wait(std::uint32_t seen, TimeNs timeout_ns) noexcept {
  const TimeNs start_ns = SystemClock::instance().now_ns();
  const TimeNs deadline_ns = start_ns + std::min(timeout_ns, std::numeric_limits<TimeNs>::max() - start_ns);
  waiters_.fetch_add(1, std::memory_order_seq_cst);
  bool moved_on = generation_.load(std::memory_order_seq_cst) != seen;
  for (TimeNs left_ns = deadline_ns - start_ns; !moved_on && left_ns > 0;
       left_ns = deadline_ns - SystemClock::instance().now_ns()) {
    const timespec timeout{left_ns / kNsPerSecond, left_ns % kNsPerSecond};
    futex(generation_, FUTEX_WAIT, seen, &timeout);
    moved_on = generation_.load(std::memory_order_seq_cst) != seen;
  }
  waiters_.fetch_sub(1, std::memory_order_relaxed);
  return moved_on;
}

}  // namespace posed
