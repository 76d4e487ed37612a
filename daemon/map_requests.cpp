#include "daemon/map_requests.h"

#include <string>
#include <utility>

#include <fmt/format.h>
#include <posed/map_request_t.hpp>

namespace posed {

namespace {

constexpr std::size_t kMaxPending = 16;

map_reply_t to_reply(std::int64_t id, const MapSaveOutcome& outcome) {
  map_reply_t reply;
  reply.utime = 0;
  reply.id = id;
  reply.ok = outcome.ok ? 1 : 0;
  reply.message = outcome.message;
  reply.keyframes = static_cast<std::int64_t>(outcome.keyframes);
  reply.landmarks = static_cast<std::int64_t>(outcome.landmarks);
  reply.bytes = static_cast<std::int64_t>(outcome.bytes);
  reply.duration_ms = to_ms(outcome.duration_ns);
  return reply;
}

}  // namespace

MapRequests::MapRequests(MapSaver& saver, std::function<void()> wake, const Clock& clock)
    : saver_(saver), wake_(std::move(wake)), clock_(clock) {}

void MapRequests::receive(std::span<const std::uint8_t> message) {
  map_request_t request{};
  const int size = static_cast<int>(message.size());
  if (request.decode(message.data(), 0, size) != size) {
    return;
  }
  if (request.action != map_request_t::ACTION_SAVE) {
    refuse(request.id, fmt::format("action {} is unknown; {} saves the map", request.action, map_request_t::ACTION_SAVE));
  } else if (const Status can_save = saver_.can_save(); !can_save) {
    refuse(request.id, can_save.error().message);
  } else if (pending_.size() + ready_.size() >= kMaxPending) {
    return;  // whoever floods us with requests need not be answered each time
  } else {
    pending_.push_back({request.id, saver_.request()});
    wake_();
  }
}

void MapRequests::refuse(std::int64_t id, std::string message) {
  if (ready_.size() < kMaxPending) {
    MapSaveOutcome outcome;
    outcome.message = std::move(message);
    ready_.push_back(to_reply(id, outcome));
  }
}

std::vector<map_reply_t> MapRequests::take_replies() {
  const MapSaveOutcome& outcome = saver_.newest_outcome();
  std::erase_if(pending_, [&](const Pending& pending) {
    if (pending.number > outcome.served) {
      return false;
    }
    ready_.push_back(to_reply(pending.id, outcome));
    return true;
  });
  for (map_reply_t& reply : ready_) {
    reply.utime = clock_.utc_ns(clock_.now_ns()) / kNsPerUs;
  }
  return std::exchange(ready_, {});
}

}  // namespace posed
