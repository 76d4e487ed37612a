#pragma once

#include <cstddef>
#include <cstdint>
#include <poll.h>
#include <span>

#include "core/clock.h"

namespace posed {

/// The system calls that V4L2 needs, so that tests can stand a kernel with devices of their own behind them. Each returns what
/// the call returns, or -errno. One descriptor is used by one thread at a time.
class V4l2System {
 public:
  virtual ~V4l2System() = default;

  virtual int open(const char* path) = 0;  ///< for reading and writing, not blocking, closed on exec
  virtual int close(int descriptor) = 0;
  virtual int ioctl(int descriptor, unsigned long request, void* argument) = 0;

  /// Maps `length` bytes at `offset`, shared, for reading and writing, to `*address`.
  virtual int map(int descriptor, std::size_t length, std::uint32_t offset, void** address) = 0;
  virtual int unmap(void* address, std::size_t length) = 0;

  /// Waits until a descriptor is ready, at most `timeout_ns`; 0 where none is. A signal ends the wait early, as if none were.
  virtual int poll(std::span<pollfd> descriptors, TimeNs timeout_ns) = 0;
};

/// The machine's own kernel. Has no state; thread-safe.
V4l2System& machine_v4l2();

}  // namespace posed
