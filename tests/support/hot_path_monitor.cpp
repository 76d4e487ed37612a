#include "tests/support/hot_path_monitor.h"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <execinfo.h>
#include <iterator>
#include <poll.h>
#include <pthread.h>
#include <span>
#include <time.h>
#include <unistd.h>

#include "core/thread.h"

// glibc's allocator under its other names, so that ours can stand before it without asking dlsym, which allocates.
extern "C" {
void* __libc_malloc(std::size_t);                 // NOLINT(bugprone-reserved-identifier): glibc's names
void* __libc_calloc(std::size_t, std::size_t);    // NOLINT(bugprone-reserved-identifier)
void* __libc_realloc(void*, std::size_t);         // NOLINT(bugprone-reserved-identifier)
void* __libc_memalign(std::size_t, std::size_t);  // NOLINT(bugprone-reserved-identifier)
void __libc_free(void*);                          // NOLINT(bugprone-reserved-identifier)
}

namespace {

constexpr std::size_t kMaxWatched = 4;
const char* watched_threads[kMaxWatched];
std::atomic<std::size_t> watched_count{0};  // published after the names are written
std::atomic<long> allocations{0};
std::atomic<long> locks{0};
std::atomic<long> blocking_calls{0};
std::atomic<int> first_depth{0};
void* first_stack[32];

void count(std::atomic<long>& counter) {
  const std::span<const char* const> watched(watched_threads, watched_count.load(std::memory_order_acquire));
  if (std::none_of(watched.begin(), watched.end(),
                   [](const char* name) { return std::strcmp(name, posed::current_thread_name()) == 0; })) {
    return;
  }
  counter.fetch_add(1);
  if (int none = 0; first_depth.compare_exchange_strong(none, -1)) {
    first_depth = backtrace(first_stack, std::size(first_stack));
  }
}

template <typename Function>
Function next_symbol(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

}  // namespace

namespace posed::test {

void watch_hot_path(std::initializer_list<const char*> thread_names) {
  assert(thread_names.size() <= kMaxWatched);
  allocations = 0;
  locks = 0;
  blocking_calls = 0;
  first_depth = 0;
  backtrace(first_stack, std::size(first_stack));  // its first call loads a library, which allocates
  std::copy(thread_names.begin(), thread_names.end(), watched_threads);
  watched_count.store(thread_names.size(), std::memory_order_release);
}

HotPathCounts hot_path_counts() {
  watched_count.store(0, std::memory_order_release);
  HotPathCounts counts{allocations.load(), locks.load(), blocking_calls.load(), {}};
  const int depth = first_depth.load();
  if (depth > 0) {
    char** const lines = backtrace_symbols(first_stack, depth);
    for (int i = 0; i < depth; ++i) {
      counts.first_stack += std::string(lines[i]) + "\n";
    }
    std::free(lines);
  }
  return counts;
}

}  // namespace posed::test

// The C library's functions, with ours in front. Pointers to the originals are resolved at the first call of each.
extern "C" {

void* malloc(std::size_t size) {
  count(allocations);
  return __libc_malloc(size);
}
void* calloc(std::size_t n, std::size_t size) {
  count(allocations);
  return __libc_calloc(n, size);
}
void* realloc(void* p, std::size_t size) {
  count(allocations);
  return __libc_realloc(p, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  count(allocations);
  return __libc_memalign(alignment, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
  count(allocations);
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** p, std::size_t alignment, std::size_t size) {
  count(allocations);
  *p = __libc_memalign(alignment, size);
  return *p == nullptr ? 12 : 0;  // ENOMEM
}
void free(void* p) {
  if (p != nullptr) {
    count(allocations);
  }
  __libc_free(p);
}

#define POSED_FORWARD(counter, result, name, parameters, arguments)        \
  result name parameters {                                                 \
    static const auto original = next_symbol<result(*) parameters>(#name); \
    count(counter);                                                        \
    return original arguments;                                             \
  }

POSED_FORWARD(locks, int, pthread_mutex_lock, (pthread_mutex_t * m), (m))
POSED_FORWARD(locks, int, pthread_mutex_trylock, (pthread_mutex_t * m), (m))
POSED_FORWARD(locks, int, pthread_rwlock_rdlock, (pthread_rwlock_t * l), (l))
POSED_FORWARD(locks, int, pthread_rwlock_wrlock, (pthread_rwlock_t * l), (l))
POSED_FORWARD(locks, int, pthread_cond_wait, (pthread_cond_t * c, pthread_mutex_t* m), (c, m))
POSED_FORWARD(blocking_calls, int, nanosleep, (const timespec* t, timespec* left), (t, left))
POSED_FORWARD(blocking_calls, int, clock_nanosleep, (clockid_t id, int flags, const timespec* t, timespec* left),
              (id, flags, t, left))
POSED_FORWARD(blocking_calls, ssize_t, read, (int fd, void* p, std::size_t n), (fd, p, n))
POSED_FORWARD(blocking_calls, ssize_t, write, (int fd, const void* p, std::size_t n), (fd, p, n))
POSED_FORWARD(blocking_calls, int, poll, (pollfd * fds, nfds_t n, int timeout), (fds, n, timeout))
POSED_FORWARD(blocking_calls, int, fsync, (int fd), (fd))

}  // extern "C"
