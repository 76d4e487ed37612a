#pragma once

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace posed {

/// A queue between exactly one producer thread and one consumer thread that refuses when full. Elements are filled and read in
/// place, so large ones (a keyframe with all its features) cross threads without a copy and keep their buffers from use to use.
/// Lock-free; no allocation after construction. Producer: `claim`, `commit`. Consumer: `front`, `release`. Any thread: `size`,
/// `capacity`.
template <typename T>
class BoundedRing {
 public:
  explicit BoundedRing(std::size_t capacity) : cells_(capacity) { assert(capacity > 0); }

  /// Producer. The cell to fill next, as it was left, or null where the ring is full. Claiming twice gives the same cell.
  T* claim() noexcept {
    const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
    return tail - head_.load(std::memory_order_acquire) == cells_.size() ? nullptr : &cells_[tail % cells_.size()];
  }

  /// Producer. Hands the claimed cell to the consumer.
  void commit() noexcept {
    assert(claim() != nullptr && "nothing was claimed");
    tail_.store(tail_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }

  /// Consumer. The oldest element, or null where there is none. It stays valid until `release`.
  T* front() noexcept {
    const std::uint64_t head = head_.load(std::memory_order_relaxed);
    return head == tail_.load(std::memory_order_acquire) ? nullptr : &cells_[head % cells_.size()];
  }

  /// Consumer. Gives the cell of `front` back to the producer.
  void release() noexcept {
    assert(front() != nullptr && "nothing to release");
    head_.store(head_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }

  /// Committed elements: a snapshot that either side may change at once.
  std::size_t size() const noexcept {
    const std::uint64_t head = head_.load(std::memory_order_acquire);  // first, so that the difference is never negative
    const std::uint64_t queued = tail_.load(std::memory_order_acquire) - head;
    return std::min(static_cast<std::size_t>(queued), cells_.size());  // both sides may have moved on in between
  }

  std::size_t capacity() const noexcept { return cells_.size(); }

  /// Before any thread uses the ring: gives every cell its working size.
  template <typename Prepare>
  void prepare(Prepare&& prepare_cell) {
    for (T& cell : cells_) {
      prepare_cell(cell);
    }
  }

 private:
  static constexpr std::size_t kCacheLine = 64;
  std::vector<T> cells_;
  alignas(kCacheLine) std::atomic<std::uint64_t> head_{0};
  alignas(kCacheLine) std::atomic<std::uint64_t> tail_{0};
};

}  // namespace posed
