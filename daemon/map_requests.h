#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <posed/map_reply_t.hpp>

#include "core/clock.h"
#include "daemon/map_saver.h"

namespace posed {

/// Takes map_request_t messages, passes them to the mapping thread, and makes the replies. Thread-bound to the publisher thread.
class MapRequests {
 public:
  /// `wake` makes the mapping thread look for requests. `saver` and `clock` must outlive it.
  MapRequests(MapSaver& saver, std::function<void()> wake, const Clock& clock);

  /// A message as it came from the transport; what is no request is ignored.
  void receive(std::span<const std::uint8_t> message);

  /// The replies that are ready to be sent.
  std::vector<map_reply_t> take_replies();

 private:
  struct Pending {
    std::int64_t id = 0;
    std::uint64_t number = 0;  ///< of MapSaver's requests
  };

  void refuse(std::int64_t id, std::string message);

  MapSaver& saver_;
  std::function<void()> wake_;
  const Clock& clock_;
  std::vector<Pending> pending_;
  std::vector<map_reply_t> ready_;
};

}  // namespace posed
