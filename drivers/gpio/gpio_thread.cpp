#include "drivers/gpio/gpio_thread.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <ctime>
#include <poll.h>
#include <stop_token>
#include <string>
#include <system_error>
#include <unistd.h>
#include <utility>

#include <sys/eventfd.h>
#include <sys/prctl.h>

#include "core/file_descriptor.h"
#include "drivers/gpio/gpio_worker.h"

namespace posed {

namespace {

class GpioThread final : public GpioLines {
 public:
  GpioThread(const GpioConfig& config, std::unique_ptr<LineAccess> access, const Clock& clock, HeldLine::ErrorSink on_error,
             FileDescriptor wake)
      : clock_(clock), worker_(config, std::move(access), clock, std::move(on_error)), wake_(std::move(wake)) {}

  void start(ThreadOptions options) {
    thread_ = NamedThread(std::move(options), [this](const std::stop_token& stop) { run(stop); });
  }

  void show(LightState state) noexcept override {
    if (worker_.show(state)) {
      wake();
    }
  }

  bool enabled() const noexcept override { return worker_.enabled(); }
  GpioHealth health() const noexcept override { return worker_.health(); }

 private:
  void run(const std::stop_token& stop) {
    // The kernel may wake threads that are not real-time 50 us late to save power; the trigger is worth more.
    prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
    const std::stop_callback wake_to_stop(stop, [this] { wake(); });
    while (!stop.stop_requested()) {
      wait_until(worker_.step());
    }
    worker_.finish();
  }

  /// Or until there is news.
  void wait_until(TimeNs deadline_ns) {
    std::array<pollfd, 2> waited{{{wake_.get(), POLLIN, 0}, {worker_.event_fd(), POLLIN, 0}}};  // poll passes over -1
    const TimeNs left_ns = std::max<TimeNs>(0, deadline_ns - clock_.now_ns());
    const timespec timeout{left_ns / kNsPerSecond, left_ns % kNsPerSecond};
    ppoll(waited.data(), waited.size(), deadline_ns == kNever_ns ? nullptr : &timeout, nullptr);
    if (waited[0].revents != 0) {
      eventfd_t count = 0;
      eventfd_read(wake_.get(), &count);
    }
  }

  /// Does not block: the descriptor is set so, and one that is full wakes as well.
  void wake() noexcept { eventfd_write(wake_.get(), 1); }

  const Clock& clock_;
  GpioWorker worker_;
  FileDescriptor wake_;
  NamedThread thread_;  // last, so that it ends first
};

}  // namespace

Result<std::unique_ptr<GpioLines>> make_gpio_thread(const GpioConfig& config, std::unique_ptr<LineAccess> access,
                                                    ThreadOptions thread, const Clock& clock,
                                                    std::function<void(const Error&)> on_error) {
  FileDescriptor wake(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (wake.get() < 0) {
    return make_error(ErrorCode::Unavailable, "gpio: the thread has nothing to wait on: " + std::generic_category().message(errno));
  }
  try {
    auto lines = std::make_unique<GpioThread>(config, std::move(access), clock, std::move(on_error), std::move(wake));
    lines->start(std::move(thread));
    return lines;
  } catch (const std::system_error& error) {
    return make_error(ErrorCode::Unavailable, std::string("gpio: the thread cannot start: ") + error.what());
  }
}

}  // namespace posed
