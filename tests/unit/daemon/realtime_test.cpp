// The pipeline's own part of the real-time rule: once they run, the capture and the tracking thread neither touch the heap nor take
// a lock. This program replaces malloc and pthread_mutex_lock by counting ones; the sanitizers replace them too, so there it is
// skipped.
#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <dlfcn.h>
#include <memory>
#include <mutex>
#include <pthread.h>
#include <string>
#include <string_view>
#include <thread>

#include <gtest/gtest.h>

#include "core/thread.h"
#include "daemon/pipeline.h"
#include "tests/unit/daemon/fake_transport.h"
#include "tests/unit/daemon/fakes.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define POSED_COUNTING 0
#else
#define POSED_COUNTING 1
#endif

namespace posed {
namespace {

std::atomic<bool> counting{false};
std::atomic<std::uint64_t> heap_calls{0};
std::atomic<std::uint64_t> locks{0};

bool on_realtime_thread() {
  const std::string_view name = current_thread_name();
  return name == "capture" || name == "tracker";
}

[[maybe_unused]] void count(std::atomic<std::uint64_t>& counter) {
  if (counting.load(std::memory_order_relaxed) && on_realtime_thread()) {
    counter.fetch_add(1, std::memory_order_relaxed);
  }
}

}  // namespace
}  // namespace posed

#if POSED_COUNTING
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* block);

void* malloc(std::size_t size) {
  posed::count(posed::heap_calls);
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  posed::count(posed::heap_calls);
  return __libc_calloc(count, size);
}
void* realloc(void* block, std::size_t size) {
  posed::count(posed::heap_calls);
  return __libc_realloc(block, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  posed::count(posed::heap_calls);
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** block, std::size_t alignment, std::size_t size) {
  posed::count(posed::heap_calls);
  *block = __libc_memalign(alignment, size);
  return *block == nullptr ? ENOMEM : 0;
}
void free(void* block) {
  if (block != nullptr) {
    posed::count(posed::heap_calls);
  }
  __libc_free(block);
}
int pthread_mutex_lock(pthread_mutex_t* mutex) {
  using Lock = int (*)(pthread_mutex_t*);
  static const Lock real = reinterpret_cast<Lock>(dlsym(RTLD_NEXT, "pthread_mutex_lock"));
  posed::count(posed::locks);
  return real(mutex);
}
}
#endif

namespace posed {
namespace {

constexpr std::uint64_t kWarmUpFrames = 50;
constexpr std::uint64_t kCountedFrames = 500;
constexpr std::uint64_t kBurst = 5;

class RealtimeTest : public ::testing::Test {
 protected:
  /// Runs the pipeline over stand-ins, counting after the warm-up.
  void run() {
    if (POSED_COUNTING == 0) {
      GTEST_SKIP() << "the sanitizers have the heap to themselves";
    }
    heap_calls = 0;
    locks = 0;
    Config config;
    PipelineParts parts;
    parts.source = std::make_unique<FakeSource>([this](std::uint64_t call) {
      // In bursts, which overflow the queue, but never so far ahead that the tracker would see next to nothing.
      while (call % kBurst == 0 && newest_tracked_.load() + 1 < call) {
        std::this_thread::yield();
      }
      counting = call >= kWarmUpFrames && call < kWarmUpFrames + kCountedFrames;
      return FakeSource::recording(kWarmUpFrames + kCountedFrames + 1)(call);
    });
    auto tracker = std::make_unique<FakeTracker>();
    tracker->on_frame = [this](const RgbdFrame& frame) {
      during_tracking_(frame);
      newest_tracked_ = frame.sequence;
    };
    parts.tracker = std::move(tracker);
    parts.mapper = std::make_unique<FakeMapper>();
    parts.transport = std::make_unique<FakeTransport>(std::make_shared<TransportLog>());
    AppOptions options;
    options.on_estimate = [this](const PoseEstimate&) { published_++; };
    const Result<std::unique_ptr<App>> app = make_pipeline(config, std::move(options), SystemClock::instance(), std::move(parts));
    ASSERT_TRUE(app);
    ASSERT_TRUE((*app)->start());
    ASSERT_TRUE((*app)->wait_finished(60 * kNsPerSecond));
    (*app)->stop();
    EXPECT_EQ((*app)->health().frames_captured, kWarmUpFrames + kCountedFrames + 1);
    EXPECT_GE((*app)->health().frames_tracked, (kWarmUpFrames + kCountedFrames) / kBurst);
    EXPECT_GE((*app)->health().keyframes, 2U);
    EXPECT_EQ(published_ + (*app)->health().poses_dropped, (*app)->health().frames_tracked);
  }

  std::function<void(const RgbdFrame&)> during_tracking_ = [](const RgbdFrame&) {};
  std::atomic<std::uint64_t> newest_tracked_{0};
  std::uint64_t published_ = 0;
};

TEST_F(RealtimeTest, CaptureAndTrackingNeitherAllocateNorLock) {
  run();
  EXPECT_EQ(heap_calls, 0U);
  EXPECT_EQ(locks, 0U);
}

TEST_F(RealtimeTest, TheCountsWouldShowIt) {
  auto mutex = std::make_shared<std::mutex>();
  during_tracking_ = [mutex](const RgbdFrame& frame) {
    if (frame.sequence > kWarmUpFrames) {
      const std::lock_guard lock(*mutex);
      const std::string too_long_for_the_stack(1000 + frame.sequence % 2, ' ');
    }
  };
  run();
  if (!IsSkipped()) {
    EXPECT_GT(heap_calls, 0U);
    EXPECT_GT(locks, 0U);
  }
}

}  // namespace
}  // namespace posed
