// A subscriber as users write them, in a process of its own: prints "ready", takes `COUNT` poses from CHANNEL (or gives up after 5
// s of silence) and prints how many came, how many sequence numbers are missing, and how many came out of order.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include <lcm/lcm-cpp.hpp>
#include <posed/pose_t.hpp>

namespace {

struct Receiver {
  std::int64_t received = 0;
  std::int64_t missing = 0;
  std::int64_t disordered = 0;
  std::int64_t next_sequence = 0;

  void take(const posed::pose_t* pose) {
    ++received;
    if (pose->sequence < next_sequence) {
      ++disordered;
      return;
    }
    missing += pose->sequence - next_sequence;
    next_sequence = pose->sequence + 1;
  }
};

}  // namespace

int main(int argc, char** argv) {
  constexpr int kSilenceMs = 5000;
  if (argc != 4) {
    std::fprintf(stderr, "usage: %s URL CHANNEL COUNT\n", argv[0]);
    return 64;
  }
  const std::int64_t count = std::atoll(argv[3]);
  lcm::LCM lcm(argv[1]);
  if (!lcm.good()) {
    std::puts("no LCM");
    return 69;
  }
  Receiver receiver;
  // Not a member: gcc 12 with its sanitizers miscompiles the member pointer that lcm-cpp keeps.
  void (*on_pose)(const lcm::ReceiveBuffer*, const std::string&, const posed::pose_t*, Receiver*) =
      [](const lcm::ReceiveBuffer*, const std::string&, const posed::pose_t* pose, Receiver* self) { self->take(pose); };
  lcm.subscribeFunction(argv[2], on_pose, &receiver)->setQueueCapacity(0);  // 0: as many as come
  std::puts("ready");
  std::fflush(stdout);
  while (receiver.received < count && lcm.handleTimeout(kSilenceMs) > 0) {
  }
  std::printf("received %lld missing %lld disordered %lld\n", static_cast<long long>(receiver.received),
              static_cast<long long>(receiver.missing), static_cast<long long>(receiver.disordered));
  return 0;
}
