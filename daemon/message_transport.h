#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/result.h"

namespace lcm {
class LCM;
}

namespace posed {

/// Where encoded messages go and requests come from. Thread-bound to the publisher thread. No exception leaves it.
class MessageTransport {
 public:
  using Handler = std::function<void(std::span<const std::uint8_t> message)>;

  virtual ~MessageTransport() = default;

  /// For people: the URL.
  virtual const std::string& description() const = 0;

  /// Makes ready to send; may be called again after it failed. The error (Unavailable) says how to mend what it can tell.
  virtual Status open() = 0;

  /// Sends one message; may block for as long as the system's socket does. Only after `open` succeeded. Error: Io.
  virtual Status send(const std::string& channel, std::span<const std::uint8_t> message) = 0;

  /// From the next `open` on, `receive` hands the messages of `channel` to `handler`.
  virtual void subscribe(const std::string& channel, Handler handler) = 0;

  /// Handles the messages that have come, and waits for none. Only after `open` succeeded.
  virtual void receive() = 0;
};

/// LCM. Its URL chooses the provider: `udpm://...` (UDP multicast), `memq://` (within the process), `file://...?mode=w` (a log).
class LcmTransport final : public MessageTransport {
 public:
  explicit LcmTransport(std::string url);
  ~LcmTransport() override;

  const std::string& description() const override { return url_; }
  Status open() override;
  Status send(const std::string& channel, std::span<const std::uint8_t> message) override;
  void subscribe(const std::string& channel, Handler handler) override;
  void receive() override;

  /// The instance of liblcm, to subscribe to a `memq://` of one's own; null before `open` succeeded.
  lcm::LCM* handle() { return lcm_.get(); }

 private:
  struct Subscription {
    std::string channel;
    Handler handler;
  };

  std::string url_;
  std::vector<std::unique_ptr<Subscription>> subscriptions_;  // liblcm keeps their addresses
  std::unique_ptr<lcm::LCM> lcm_;
  bool receives_ = false;  // without it, liblcm must not be asked: it aborts
};

}  // namespace posed
