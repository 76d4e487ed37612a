#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace posed {

/// Hands the newest value from exactly one producer thread to one consumer thread; older ones are overwritten (a triple buffer).
/// Neither side ever waits. The three values live here for good, so what they own (vectors, say) is allocated and freed by the
/// producer alone: the consumer reads in place. Lock-free. Producer: `back`, `publish`. Consumer: `refresh`, `front`.
template <typename T>
class LatestValue {
 public:
  /// Producer. The value to fill next. It holds some value published earlier, however long ago, or its initial one: overwrite it
  /// all.
  T& back() noexcept { return slots_[back_].value; }

  /// Producer. Makes `back()` the newest value.
  void publish() noexcept {
    const std::uint8_t previous = middle_.exchange(static_cast<std::uint8_t>(back_ | kFresh), std::memory_order_acq_rel);
    back_ = previous & kIndexMask;
  }

  /// Consumer. Makes `front()` the newest value; true where it is one that was not seen before.
  bool refresh() noexcept {
    if ((middle_.load(std::memory_order_relaxed) & kFresh) == 0) {
      return false;
    }
    const std::uint8_t previous = middle_.exchange(front_, std::memory_order_acq_rel);
    front_ = previous & kIndexMask;
    return true;
  }

  /// Consumer. The value of the last `refresh`, default-constructed before the first; unchanged until the next `refresh`.
  const T& front() const noexcept { return slots_[front_].value; }

  /// Before any thread uses it: gives all three values their working size.
  template <typename Prepare>
  void prepare(Prepare&& prepare_value) {
    for (Slot& slot : slots_) {
      prepare_value(slot.value);
    }
  }

 private:
  static constexpr std::uint8_t kFresh = 4;
  static constexpr std::uint8_t kIndexMask = 3;
  static constexpr std::size_t kCacheLine = 64;

  // Own cache lines, so that writing one value does not slow the reading of another.
  struct alignas(kCacheLine) Slot {
    T value{};
  };

  std::array<Slot, 3> slots_{};
  alignas(kCacheLine) std::uint8_t back_ = 0;                // producer's own
  alignas(kCacheLine) std::atomic<std::uint8_t> middle_{1};  // index of the value in between, and whether it is unread
  alignas(kCacheLine) std::uint8_t front_ = 2;               // consumer's own
};

}  // namespace posed
