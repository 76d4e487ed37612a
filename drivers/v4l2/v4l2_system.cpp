#include "drivers/v4l2/v4l2_system.h"

#include <algorithm>
#include <cerrno>
#include <ctime>
#include <fcntl.h>
#include <unistd.h>

#include <sys/ioctl.h>
#include <sys/mman.h>

namespace posed {

namespace {

int result_of(int returned) {
  return returned < 0 ? -errno : returned;
}

class MachineV4l2 final : public V4l2System {
 public:
  int open(const char* path) override { return result_of(::open(path, O_RDWR | O_NONBLOCK | O_CLOEXEC)); }

  int close(int descriptor) override { return result_of(::close(descriptor)); }

  int ioctl(int descriptor, unsigned long request, void* argument) override {
    int returned = 0;
    do {
      returned = result_of(::ioctl(descriptor, request, argument));
    } while (returned == -EINTR);
    return returned;
  }

  int map(int descriptor, std::size_t length, std::uint32_t offset, void** address) override {
    void* mapped = ::mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, static_cast<off_t>(offset));
    if (mapped == MAP_FAILED) {
      return -errno;
    }
    *address = mapped;
    return 0;
  }

  int unmap(void* address, std::size_t length) override { return result_of(::munmap(address, length)); }

  int poll(std::span<pollfd> descriptors, TimeNs timeout_ns) override {
    const TimeNs wait_ns = std::max<TimeNs>(timeout_ns, 0);
    const timespec timeout{static_cast<time_t>(wait_ns / kNsPerSecond), static_cast<long>(wait_ns % kNsPerSecond)};
    const int returned = result_of(::ppoll(descriptors.data(), descriptors.size(), &timeout, nullptr));
    if (returned <= 0) {
      for (pollfd& descriptor : descriptors) {
        descriptor.revents = 0;
      }
    }
    return returned == -EINTR ? 0 : returned;
  }
};

}  // namespace

V4l2System& machine_v4l2() {
  static MachineV4l2 machine;
  return machine;
}

}  // namespace posed
