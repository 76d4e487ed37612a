// Any bytes as a message on the channel of map requests: a request is answered, and what is none is ignored.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "daemon/map_requests.h"
#include "tests/support/stepping_clock.h"
#include "tests/unit/daemon/fake_mapper.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace posed;
  const SteppingClock clock;
  FakeMapper mapper;
  MapSaver saver(mapper, {}, 0, clock);
  MapRequests requests(
      saver, [] {}, clock);
  requests.receive(std::span<const std::uint8_t>(data, size));
  if (requests.take_replies().size() > 1) {
    std::abort();
  }
  return 0;
}
