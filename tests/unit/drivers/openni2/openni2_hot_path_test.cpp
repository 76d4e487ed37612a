#include <atomic>
#include <chrono>
#include <cstdlib>
#include <dlfcn.h>
#include <new>
#include <stop_token>
#include <string_view>
#include <thread>

#include "core/thread.h"
#include "tests/unit/drivers/openni2/openni2_rig.h"

namespace posed::test {
namespace {

std::atomic<bool> watching = false;
thread_local bool is_capture = false;
std::atomic<int> by_openni2 = 0;
std::atomic<int> by_others = 0;

void count(const void* caller) {
  if (!is_capture || !watching) {
    return;
  }
  Dl_info module{};
  const bool known = dladdr(caller, &module) != 0 && module.dli_fname != nullptr;
  const bool openni2 = known && std::string_view(module.dli_fname).find("libOpenNI2.so") != std::string_view::npos;
  ++(openni2 ? by_openni2 : by_others);
}

}  // namespace
}  // namespace posed::test

// In place of the C++ library's, for all libraries of this program. Not inlined: their callers are looked at.
[[gnu::noinline]] void* operator new(std::size_t bytes) {
  posed::test::count(__builtin_return_address(0));
  if (void* memory = std::malloc(bytes)) {
    return memory;
  }
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t /*bytes*/) noexcept {
  std::free(memory);
}

namespace posed::test {
namespace {

using namespace std::chrono_literals;

/// OpenNI2 itself makes entries of lists where an image is given back; nothing else asks for memory.
TEST(OpenNi2HotPath, CaptureDoesNotAllocate) {
  constexpr int kWarmUp = 10;
  constexpr int kFrames = 60;
  fake_openni2().plug(fake_camera());
  Running running(openni2_config(), SystemClock::instance());
  std::atomic<int> frames = 0;
  NamedThread capture({.name = "capture"}, [&](const std::stop_token& stop) {
    is_capture = true;
    while (!stop.stop_requested()) {
      frames += running.source().next(stop).kind == CaptureKind::Frame ? 1 : 0;
    }
    watching = true;
    by_others = 0;
    ::operator delete(::operator new(1));  // that it would be seen
  });
  int by_others_while_running = -1;
  for (int i = 1; i <= kWarmUp + kFrames; ++i) {
    watching = i > kWarmUp;
    const int before = frames;
    while (!push_pair(static_cast<std::uint64_t>(i) * 33'333, i)) {
      std::this_thread::sleep_for(1ms);
    }
    while (frames == before) {
      std::this_thread::sleep_for(1ms);
    }
    by_others_while_running = by_others;
  }
  watching = false;
  capture.request_stop();
  capture.join();
  EXPECT_EQ(by_others_while_running, 0);
  EXPECT_GE(by_openni2, kFrames) << "the thread was watched";
  EXPECT_EQ(by_others, 1) << "and what it allocates is seen";
}

}  // namespace
}  // namespace posed::test
