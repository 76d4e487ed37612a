// The cost of handing data from thread to thread, against the obvious way with a mutex. *Uncontended: one thread does both sides,
// so that only the operations are measured. *TwoThreads: the real thing, with the cache line traffic and (for the mutex) the
// waiting.

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include "core/frame_pool.h"
#include "core/latest_value.h"
#include "core/overflow_ring.h"

namespace posed {
namespace {

constexpr std::size_t kCapacity = 8;
using Element = std::uint64_t;
using LargeValue = std::array<std::uint64_t, 64>;  // 512 bytes, the size of a pose with its covariance

/// What OverflowRing would be with a mutex.
class LockedQueue {
 public:
  explicit LockedQueue(std::size_t capacity) : capacity_(capacity) {}

  std::optional<Element> push(Element value) {
    const std::lock_guard lock(mutex_);
    std::optional<Element> oldest;
    if (queue_.size() == capacity_) {
      oldest = queue_.front();
      queue_.pop_front();
    }
    queue_.push_back(value);
    return oldest;
  }
  std::optional<Element> pop() {
    const std::lock_guard lock(mutex_);
    if (queue_.empty()) {
      return std::nullopt;
    }
    const Element value = queue_.front();
    queue_.pop_front();
    return value;
  }

 private:
  std::mutex mutex_;
  std::size_t capacity_;
  std::deque<Element> queue_;
};

/// What LatestValue would be with a mutex: both sides copy under the lock.
class LockedValue {
 public:
  void publish(const LargeValue& value) {
    const std::lock_guard lock(mutex_);
    value_ = value;
    fresh_ = true;
  }
  bool refresh(LargeValue& value) {
    const std::lock_guard lock(mutex_);
    if (!fresh_) {
      return false;
    }
    value = value_;
    fresh_ = false;
    return true;
  }

 private:
  std::mutex mutex_;
  LargeValue value_{};
  bool fresh_ = false;
};

template <typename Queue>
void BM_QueueUncontended(benchmark::State& state) {
  Queue queue(kCapacity);
  Element value = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(queue.push(++value));
    benchmark::DoNotOptimize(queue.pop());
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK_TEMPLATE(BM_QueueUncontended, OverflowRing<Element>);
BENCHMARK_TEMPLATE(BM_QueueUncontended, LockedQueue);

template <typename Queue>
void BM_QueueOverflowing(benchmark::State& state) {
  Queue queue(kCapacity);
  Element value = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(queue.push(++value));
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK_TEMPLATE(BM_QueueOverflowing, OverflowRing<Element>);
BENCHMARK_TEMPLATE(BM_QueueOverflowing, LockedQueue);

/// The producer's time a push while the consumer pops as fast as it can.
template <typename Queue>
void BM_QueueTwoThreads(benchmark::State& state) {
  Queue queue(kCapacity);
  std::atomic<bool> done{false};
  std::uint64_t popped = 0;
  std::thread consumer([&] {
    while (!done.load(std::memory_order_relaxed)) {
      popped += queue.pop() ? 1 : 0;
    }
  });
  Element value = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(queue.push(++value));
  }
  done = true;
  consumer.join();
  state.SetItemsProcessed(state.iterations());
  state.counters["delivered"] = static_cast<double>(popped) / static_cast<double>(value);
}
BENCHMARK_TEMPLATE(BM_QueueTwoThreads, OverflowRing<Element>)->UseRealTime();
BENCHMARK_TEMPLATE(BM_QueueTwoThreads, LockedQueue)->UseRealTime();

void BM_LatestValueUncontended(benchmark::State& state) {
  LatestValue<LargeValue> latest;
  std::uint64_t number = 0;
  for (auto _ : state) {
    latest.back().fill(++number);
    latest.publish();
    benchmark::DoNotOptimize(latest.refresh());
    benchmark::DoNotOptimize(latest.front().back());
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_LatestValueUncontended);

void BM_LockedValueUncontended(benchmark::State& state) {
  LockedValue locked;
  LargeValue mine{};
  LargeValue read{};
  std::uint64_t number = 0;
  for (auto _ : state) {
    mine.fill(++number);
    locked.publish(mine);
    benchmark::DoNotOptimize(locked.refresh(read));
    benchmark::DoNotOptimize(read.back());
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_LockedValueUncontended);

void BM_LatestValueTwoThreads(benchmark::State& state) {
  LatestValue<LargeValue> latest;
  std::atomic<bool> done{false};
  std::thread consumer([&] {
    while (!done.load(std::memory_order_relaxed)) {
      latest.refresh();
      benchmark::DoNotOptimize(latest.front().back());
    }
  });
  std::uint64_t number = 0;
  for (auto _ : state) {
    latest.back().fill(++number);
    latest.publish();
  }
  done = true;
  consumer.join();
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_LatestValueTwoThreads)->UseRealTime();

void BM_LockedValueTwoThreads(benchmark::State& state) {
  LockedValue locked;
  std::atomic<bool> done{false};
  std::thread consumer([&] {
    LargeValue read{};
    while (!done.load(std::memory_order_relaxed)) {
      locked.refresh(read);
      benchmark::DoNotOptimize(read.back());
    }
  });
  LargeValue mine{};
  std::uint64_t number = 0;
  for (auto _ : state) {
    mine.fill(++number);
    locked.publish(mine);
  }
  done = true;
  consumer.join();
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_LockedValueTwoThreads)->UseRealTime();

void BM_FramePoolAcquireRelease(benchmark::State& state) {
  FramePool pool(640, 480, 16);
  for (auto _ : state) {
    const FrameRef frame = std::move(*pool.acquire()).share();
    benchmark::DoNotOptimize(frame->sequence);
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_FramePoolAcquireRelease);

void BM_FramePoolAcquireLastFreeSlot(benchmark::State& state) {
  FramePool pool(640, 480, 16);
  std::vector<FrameRef> held;
  for (int i = 0; i < 15; ++i) {
    held.push_back(std::move(*pool.acquire()).share());
  }
  for (auto _ : state) {
    const FrameRef frame = std::move(*pool.acquire()).share();
    benchmark::DoNotOptimize(frame->sequence);
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_FramePoolAcquireLastFreeSlot);

/// Frames from thread to thread through an OverflowRing, as between capture and tracker: the capture thread's time a frame.
void BM_FrameHandOffTwoThreads(benchmark::State& state) {
  FramePool pool(640, 480, 16);
  OverflowRing<FrameRef> ring(2);
  std::atomic<bool> done{false};
  std::thread consumer([&] {
    while (!done.load(std::memory_order_relaxed)) {
      if (const std::optional<FrameRef> frame = ring.pop()) {
        benchmark::DoNotOptimize((*frame)->sequence);
      }
    }
  });
  for (auto _ : state) {
    ring.push(std::move(*pool.acquire()).share());
  }
  done = true;
  consumer.join();
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_FrameHandOffTwoThreads)->UseRealTime();

}  // namespace
}  // namespace posed
