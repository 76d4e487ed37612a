#include <atomic>
#include <cstdint>
#include <latch>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "core/latest_value.h"
#include "tests/stress/payload.h"

namespace posed {
namespace {

/// Owns memory, as a map snapshot does: the producer resizes it, the consumer only reads.
struct Snapshot {
  Payload payload;
  std::vector<std::uint64_t> landmarks;
};

TEST(LatestValueStress, TheConsumerSeesWholeValuesThatOnlyGetNewerAndTheLastOne) {
  constexpr std::uint64_t kValues = 200'000;
  LatestValue<Snapshot> latest;
  std::latch start(2);
  std::atomic<bool> produced{false};
  std::uint64_t torn = 0;
  std::uint64_t not_newer = 0;
  std::uint64_t changed_while_held = 0;
  std::uint64_t seen_last = 0;

  std::thread producer([&] {
    Dawdler dawdler(5);
    start.arrive_and_wait();
    for (std::uint64_t i = 1; i <= kValues; ++i) {
      Snapshot& snapshot = latest.back();
      snapshot.payload = Payload(i);
      snapshot.landmarks.assign(1 + i % 40, i);
      latest.publish();
      dawdler.step();
    }
    produced.store(true, std::memory_order_release);
  });
  std::thread consumer([&] {
    Dawdler dawdler(6);
    start.arrive_and_wait();
    bool last_round = false;
    while (!last_round) {
      last_round = produced.load(std::memory_order_acquire);  // read before the last refresh
      if (!latest.refresh()) {
        std::this_thread::yield();
        continue;
      }
      const Snapshot& snapshot = latest.front();
      const std::uint64_t number = snapshot.payload.number();
      not_newer += number > seen_last ? 0 : 1;
      seen_last = number;
      dawdler.step();  // the producer publishes meanwhile
      torn += snapshot.payload.is_whole() ? 0 : 1;
      changed_while_held += snapshot.payload.number() == number ? 0 : 1;
      torn += snapshot.landmarks == std::vector<std::uint64_t>(1 + number % 40, number) ? 0 : 1;
    }
  });
  producer.join();
  consumer.join();

  EXPECT_EQ(torn, 0u);
  EXPECT_EQ(not_newer, 0u);
  EXPECT_EQ(changed_while_held, 0u);
  EXPECT_EQ(seen_last, kValues);
  EXPECT_FALSE(latest.refresh());
}

}  // namespace
}  // namespace posed
