#pragma once

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

namespace posed {

namespace detail {

constexpr std::size_t kCacheLine = 64;

/// Single-producer single-consumer ring of slot numbers that hands the oldest back when full. Positions count up for ever (64 bit),
/// so a position is never mistaken for an earlier one; both sides claim the oldest entry by compare-and-swap on `head_`.
class IndexRing {
 public:
  explicit IndexRing(std::size_t capacity)
      : capacity_(capacity), entries_(std::make_unique<std::atomic<std::uint32_t>[]>(capacity)) {}

  /// Producer. The oldest entry where the ring was full.
  std::optional<std::uint32_t> push(std::uint32_t index) noexcept {
    const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
    std::uint64_t head = head_.load(std::memory_order_acquire);
    std::optional<std::uint32_t> oldest;
    if (tail - head == capacity_) {
      const std::uint32_t value = entries_[head % capacity_].load(std::memory_order_relaxed);
      if (head_.compare_exchange_strong(head, head + 1, std::memory_order_acq_rel, std::memory_order_acquire)) {
        oldest = value;  // otherwise the consumer took it in this instant, and there is room
      }
    }
    entries_[tail % capacity_].store(index, std::memory_order_relaxed);
    tail_.store(tail + 1, std::memory_order_release);
    return oldest;
  }

  /// Consumer. The oldest entry, if any.
  std::optional<std::uint32_t> pop() noexcept {
    std::uint64_t head = head_.load(std::memory_order_acquire);
    while (head != tail_.load(std::memory_order_acquire)) {
      const std::uint32_t value = entries_[head % capacity_].load(std::memory_order_relaxed);
      // A failed exchange means that the producer overflowed this entry away, and `value` may be newer than it: look again.
      if (head_.compare_exchange_strong(head, head + 1, std::memory_order_acq_rel, std::memory_order_acquire)) {
        return value;
      }
    }
    return std::nullopt;
  }

  std::size_t size() const noexcept {
    const std::uint64_t head = head_.load(std::memory_order_acquire);  // first, so that the difference is never negative
    const std::uint64_t queued = tail_.load(std::memory_order_acquire) - head;
    return std::min(static_cast<std::size_t>(queued), capacity_);  // both sides may have moved on in between
  }

  std::size_t capacity() const noexcept { return capacity_; }

 private:
  std::size_t capacity_;
  std::unique_ptr<std::atomic<std::uint32_t>[]> entries_;
  alignas(kCacheLine) std::atomic<std::uint64_t> head_{0};
  alignas(kCacheLine) std::atomic<std::uint64_t> tail_{0};
};

}  // namespace detail

/// A queue between exactly one producer thread and one consumer thread that never blocks and never refuses: when it is full, `push`
/// hands the oldest element back to the producer, who drops and counts it. Lock-free; no allocation after construction.
/// `push` belongs to the producer thread, `pop` to the consumer thread; any thread may call `size` (a snapshot that either side may
/// change at once) and `capacity`. Moving a T must not throw.
///
/// Elements lie in capacity + 2 cells; what crosses threads is the number of a cell. One cell can be in the consumer's hands and
/// one in the producer's while `capacity` are queued, so the producer always finds a free one: who sees the consumer's k-th pop in
/// `queued_` also sees the k - 1 cells it freed before.
template <typename T>
class OverflowRing {
 public:
  explicit OverflowRing(std::size_t capacity)
      : cells_(std::make_unique<T[]>(capacity + 2)), queued_(capacity), free_(capacity + 2) {
    assert(capacity > 0);
    for (std::uint32_t i = 0; i < capacity + 2; ++i) {
      free_.push(i);
    }
  }

  /// Producer. Enqueues `value`; returns the oldest element where the ring was full.
  std::optional<T> push(T value) noexcept {
    const std::uint32_t cell = take_free_cell();
    cells_[cell] = std::move(value);
    const std::optional<std::uint32_t> oldest = queued_.push(cell);
    if (!oldest) {
      return std::nullopt;
    }
    spare_ = *oldest;
    return std::exchange(cells_[*oldest], T{});
  }

  /// Consumer. The oldest element, if any.
  std::optional<T> pop() noexcept {
    const std::optional<std::uint32_t> cell = queued_.pop();
    if (!cell) {
      return std::nullopt;
    }
    std::optional<T> value(std::exchange(cells_[*cell], T{}));
    free_.push(*cell);
    return value;
  }

  std::size_t size() const noexcept { return queued_.size(); }
  std::size_t capacity() const noexcept { return queued_.capacity(); }

 private:
  std::uint32_t take_free_cell() noexcept {
    const std::optional<std::uint32_t> cell = spare_ ? std::exchange(spare_, std::nullopt) : free_.pop();
    assert(cell && "more than one producer or consumer");
    return *cell;
  }

  std::unique_ptr<T[]> cells_;
  detail::IndexRing queued_;
  detail::IndexRing free_;
  std::optional<std::uint32_t> spare_;  // producer's own: the cell of the last overflow
};

}  // namespace posed
