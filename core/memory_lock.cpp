#include "core/memory_lock.h"

#include <cerrno>
#include <limits>
#include <malloc.h>
#include <system_error>

#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/resource.h>

namespace posed {

Status lock_memory() {
  rlimit limit{};
  if (getrlimit(RLIMIT_MEMLOCK, &limit) != 0 || limit.rlim_cur != RLIM_INFINITY) {
    // A process with CAP_IPC_LOCK may lift its own limit; any other is told which one it has.
    const rlimit lifted{RLIM_INFINITY, RLIM_INFINITY};
    if (setrlimit(RLIMIT_MEMLOCK, &lifted) != 0) {
      return make_error(ErrorCode::Unavailable,
                        fmt::format("memory is not locked: the limit on locked memory is {} KiB and must be infinite "
                                    "(LimitMEMLOCK=infinity in the service's unit, or ulimit -l unlimited)",
                                    limit.rlim_cur / 1024));
    }
  }
  if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
    return make_error(ErrorCode::Unavailable,
                      fmt::format("memory is not locked: mlockall: {}", std::generic_category().message(errno)));
  }
  // What is freed stays ours, and large blocks come from the heap, too: neither costs page faults when it is used again.
  mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
  mallopt(M_MMAP_MAX, 0);
  return {};
}

std::uint64_t thread_page_faults() noexcept {
  rusage usage{};
  if (getrusage(RUSAGE_THREAD, &usage) != 0) {
    return 0;
  }
  return static_cast<std::uint64_t>(usage.ru_minflt) + static_cast<std::uint64_t>(usage.ru_majflt);
}

}  // namespace posed
