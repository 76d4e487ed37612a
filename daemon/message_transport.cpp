#include "daemon/message_transport.h"

#include <utility>

#include <fmt/format.h>
#include <lcm/lcm-cpp.hpp>

namespace posed {

namespace {

std::string how_to_mend(const std::string& url) {
  if (url.starts_with("udpm://")) {
    return "if this machine has no multicast route, give it one: 'ip link set lo multicast on' and 'ip route add 224.0.0.0/4 dev "
           "lo' (as "
           "root); otherwise see whether publisher.url is a multicast address and a port, as in udpm://239.255.76.67:7667?ttl=0";
  }
  return "see whether publisher.url is a URL that LCM knows, as in udpm://239.255.76.67:7667?ttl=0";
}

}  // namespace

LcmTransport::LcmTransport(std::string url) : url_(std::move(url)) {}

LcmTransport::~LcmTransport() = default;

Status LcmTransport::open() {
  auto opened = std::make_unique<lcm::LCM>(url_);
  if (!opened->good()) {
    return make_error(ErrorCode::Unavailable, fmt::format("LCM cannot start on '{}': {}", url_, how_to_mend(url_)));
  }
  lcm_ = std::move(opened);
  return {};
}

Status LcmTransport::send(const std::string& channel, std::span<const std::uint8_t> message) {
  if (lcm_->publish(channel, message.data(), static_cast<unsigned int>(message.size())) != 0) {
    return make_error(ErrorCode::Io, fmt::format("LCM did not take {} bytes for channel {} on '{}'; {}", message.size(), channel,
                                                 url_, how_to_mend(url_)));
  }
  return {};
}

}  // namespace posed
