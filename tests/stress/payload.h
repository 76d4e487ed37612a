#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <thread>

namespace posed {

/// A value too large to be written at once, so that a reader who meets a writer in the middle sees it: all words must agree.
class Payload {
 public:
  Payload() = default;
  explicit Payload(std::uint64_t number) { words_.fill(number); }

  std::uint64_t number() const { return words_.front(); }
  bool is_whole() const {
    return std::all_of(words_.begin(), words_.end(), [this](std::uint64_t word) { return word == words_.front(); });
  }

 private:
  std::array<std::uint64_t, 16> words_{};
};

/// Lets a thread now and then dawdle for a pseudo-random, short while, so that rings are met full, empty and in between.
class Dawdler {
 public:
  explicit Dawdler(std::uint32_t seed) : state_(seed) {}

  void step() {
    state_ = state_ * 1'664'525u + 1'013'904'223u;  // a linear congruential generator; its upper bits are good enough here
    const std::uint32_t upper = state_ >> 22;       // 0 to 1023
    if (upper < 4) {
      std::this_thread::yield();  // so that both sides make progress also where there are fewer processors than threads
    } else if (upper < 256) {
      for (std::uint32_t i = upper; i > 0; --i) {
        spin_ = i;
      }
    }
  }

 private:
  std::uint32_t state_;
  volatile std::uint32_t spin_ = 0;
};

}  // namespace posed
