#include <algorithm>
#include <atomic>
#include <cstdint>
#include <deque>
#include <latch>
#include <map>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/frame_pool.h"
#include "core/overflow_ring.h"
#include "tests/stress/payload.h"

namespace posed {
namespace {

constexpr int kWidth = 24;
constexpr int kHeight = 2;
constexpr std::uint64_t kFrames = 40'000;  // a writer

/// Which slot a frame lies in, by the address of its depth image; and how many writers are in that slot right now.
class SlotWatch {
 public:
  explicit SlotWatch(FramePool& pool) : writers_(pool.slots()) {
    std::vector<FrameWriter> all;
    for (std::size_t i = 0; i < pool.slots(); ++i) {
      all.push_back(std::move(*pool.acquire()));
      slot_of_.emplace(all.back()->depth_m.data, i);
    }
  }

  std::size_t distinct_slots() const { return slot_of_.size(); }
  bool enter(const RgbdFrame& frame) {
    return writers_[slot_of_.at(frame.depth_m.data)].fetch_add(1, std::memory_order_relaxed) == 0;
  }
  void leave(const RgbdFrame& frame) { writers_[slot_of_.at(frame.depth_m.data)].fetch_sub(1, std::memory_order_relaxed); }

 private:
  std::map<const float*, std::size_t> slot_of_;
  std::vector<std::atomic<int>> writers_;
};

void fill(RgbdFrame& frame, std::uint64_t sequence) {
  frame.sequence = sequence;
  for (int y = 0; y < kHeight; ++y) {
    std::fill_n(frame.depth_m.row(y), kWidth, static_cast<float>(sequence));
    std::fill_n(frame.gray.row(y), kWidth, static_cast<std::uint8_t>(sequence));
    std::fill_n(frame.bgr.row(y), 3 * kWidth, static_cast<std::uint8_t>(sequence));
  }
}

bool is_untouched(const RgbdFrame& frame, std::uint64_t sequence) {
  bool same = frame.sequence == sequence;
  for (int y = 0; y < kHeight; ++y) {
    const float* const depth = frame.depth_m.row(y);
    const std::uint8_t* const gray = frame.gray.row(y);
    const std::uint8_t* const bgr = frame.bgr.row(y);
    same = same && std::all_of(depth, depth + kWidth, [&](float v) { return v == static_cast<float>(sequence); });
    same = same && std::all_of(gray, gray + kWidth, [&](std::uint8_t v) { return v == static_cast<std::uint8_t>(sequence); });
    same = same && std::all_of(bgr, bgr + 3 * kWidth, [&](std::uint8_t v) { return v == static_cast<std::uint8_t>(sequence); });
  }
  return same;
}

/// A writer fills frames and drops or shares them into `out`; what the ring hands back is dropped here, on the writer's thread.
struct WriterStage {
  FramePool& pool;
  SlotWatch& watch;
  OverflowRing<FrameRef>& out;
  std::uint64_t shared_slots = 0;
  std::uint64_t refused = 0;

  void run(std::uint32_t seed) {
    Dawdler dawdler(seed);
    for (std::uint64_t i = 1; i <= kFrames; ++i) {
      std::optional<FrameWriter> writer = pool.acquire();
      if (!writer) {
        ++refused;
        std::this_thread::yield();
        continue;
      }
      shared_slots += watch.enter(**writer) ? 0 : 1;
      fill(**writer, i);
      dawdler.step();
      watch.leave(**writer);
      if (i % 16 != 0) {  // otherwise the frame is given up, and the writer's destructor returns the slot
        out.push(std::move(*writer).share());
      }
    }
  }
};

/// A reader holds the last few frames, checks them again when it lets go, and passes a second hold on to `out`.
struct ReaderStage {
  OverflowRing<FrameRef>& in;
  OverflowRing<FrameRef>* out;
  const std::atomic<bool>& input_ended;
  std::uint64_t changed = 0;
  std::uint64_t out_of_order = 0;
  std::uint64_t read = 0;

  void run(std::uint32_t seed) {
    Dawdler dawdler(seed);
    std::deque<std::pair<FrameRef, std::uint64_t>> held;
    std::uint64_t last = 0;
    bool last_round = false;
    while (!last_round) {
      last_round = input_ended.load(std::memory_order_acquire);
      while (const std::optional<FrameRef> frame = in.pop()) {
        const std::uint64_t sequence = (*frame)->sequence;
        out_of_order += sequence > last ? 0 : 1;
        last = sequence;
        changed += is_untouched(**frame, sequence) ? 0 : 1;
        if (out != nullptr) {
          out->push(*frame);
        }
        held.emplace_back(*frame, sequence);
        if (held.size() > 2) {
          changed += is_untouched(*held.front().first, held.front().second) ? 0 : 1;
          held.pop_front();
        }
        ++read;
        dawdler.step();
      }
      std::this_thread::yield();
    }
  }
};

TEST(FramePoolStress, SlotsHaveOneWriterNeverChangeWhileHeldAndAllComeBack) {
  FramePool pool(kWidth, kHeight, 12);  // fewer than all stages together could hold, so that acquiring sometimes fails
  SlotWatch watch(pool);
  ASSERT_EQ(watch.distinct_slots(), pool.slots());

  std::atomic<bool> written{false};
  std::atomic<bool> passed_on{false};
  {
    OverflowRing<FrameRef> ring_a(2);
    OverflowRing<FrameRef> ring_b(3);
    OverflowRing<FrameRef> ring_c(2);
    WriterStage writer_a{pool, watch, ring_a};
    WriterStage writer_b{pool, watch, ring_b};
    ReaderStage reader_a{ring_a, &ring_c, written};
    ReaderStage reader_b{ring_b, nullptr, written};
    ReaderStage reader_c{ring_c, nullptr, passed_on};

    std::latch start(5);
    const auto on_thread = [&start](auto& stage, std::uint32_t seed) {
      return std::thread([&start, &stage, seed] {
        start.arrive_and_wait();
        stage.run(seed);
      });
    };
    std::thread thread_a = on_thread(writer_a, 7);
    std::thread thread_b = on_thread(writer_b, 8);
    std::thread thread_c = on_thread(reader_a, 9);
    std::thread thread_d = on_thread(reader_b, 10);
    std::thread thread_e = on_thread(reader_c, 11);
    thread_a.join();
    thread_b.join();
    written.store(true, std::memory_order_release);
    thread_c.join();
    thread_d.join();
    passed_on.store(true, std::memory_order_release);
    thread_e.join();

    for (const WriterStage* writer : {&writer_a, &writer_b}) {
      EXPECT_EQ(writer->shared_slots, 0u);
      EXPECT_LT(writer->refused, kFrames);
    }
    for (const ReaderStage* reader : {&reader_a, &reader_b, &reader_c}) {
      EXPECT_EQ(reader->changed, 0u);
      EXPECT_EQ(reader->out_of_order, 0u);
      EXPECT_GT(reader->read, 0u);
    }
  }
  EXPECT_EQ(pool.free_slots(), pool.slots());
}

}  // namespace
}  // namespace posed
