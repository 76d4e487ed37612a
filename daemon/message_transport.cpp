#include "daemon/message_transport.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>
#include <lcm/lcm-cpp.hpp>

#include "core/logging.h"

namespace posed {

namespace {

std::string how_to_mend(const std::string& url) {
  if (url.starts_with("udpm://")) {
    return "if this machine has no multicast route, give it one: 'ip link set lo multicast on' and 'ip route add 224.0.0.0/4 dev "
           "lo' (as root); otherwise see whether publisher.url is a multicast address and a port, as in "
           "udpm://239.255.76.67:7667?ttl=0";
  }
  return "see whether publisher.url is a URL that LCM knows, as in udpm://239.255.76.67:7667?ttl=0";
}

/// liblcm (1.3.1) that gets no pipe closes descriptor 0, whatever that is.
Status check_pipe() {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) {
    return make_error(ErrorCode::Unavailable, fmt::format("no pipe for LCM: {}", std::strerror(errno)));
  }
  ::close(ends[0]);
  ::close(ends[1]);
  return {};
}

}  // namespace

LcmTransport::LcmTransport(std::string url) : url_(std::move(url)) {}

LcmTransport::~LcmTransport() = default;

Status LcmTransport::open() {
  if (Status possible = check_pipe(); !possible) {
    return possible;
  }
  auto opened = std::make_unique<lcm::LCM>(url_);
  if (!opened->good()) {
    return make_error(ErrorCode::Unavailable, fmt::format("LCM cannot start on '{}': {}", url_, how_to_mend(url_)));
  }
  receives_ = !subscriptions_.empty();
  for (const std::unique_ptr<Subscription>& subscription : subscriptions_) {
    // In C, since liblcm's C++ hides whether it worked; the first one waits up to 10 s for a message from itself to come back.
    const lcm_msg_handler_t hand_on = [](const lcm_recv_buf_t* received, const char*, void* to) {
      static_cast<Subscription*>(to)->handler({static_cast<const std::uint8_t*>(received->data), received->data_size});
    };
    receives_ = receives_ &&
                lcm_subscribe(opened->getUnderlyingLCM(), subscription->channel.c_str(), hand_on, subscription.get()) != nullptr;
  }
  if (!receives_ && !subscriptions_.empty()) {
    log_warning(
        "LCM receives nothing on '{}', not even what it sends itself: see the routing tables and the firewall. Requests to "
        "this daemon are not answered; what it publishes may not arrive either",
        url_);
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

void LcmTransport::subscribe(const std::string& channel, Handler handler) {
  subscriptions_.push_back(std::make_unique<Subscription>(Subscription{channel, std::move(handler)}));
}

void LcmTransport::receive() {
  constexpr int kAtMost = 16;  // so that a flood of requests does not keep poses waiting
  for (int i = 0; i < kAtMost && receives_ && lcm_->handleTimeout(0) > 0; ++i) {
  }
}

}  // namespace posed
