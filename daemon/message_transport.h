#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "core/result.h"

namespace lcm {
class LCM;
}

namespace posed {

/// Where encoded messages go. Thread-bound to the publisher thread. No exception leaves it.
class MessageTransport {
 public:
  virtual ~MessageTransport() = default;

  /// For people: the URL.
  virtual const std::string& description() const = 0;

  /// Makes ready to send; may be called again after it failed. The error (Unavailable) says how to mend what it can tell.
  virtual Status open() = 0;

  /// Sends one message; may block for as long as the system's socket does. Only after `open` succeeded. Error: Io.
  virtual Status send(const std::string& channel, std::span<const std::uint8_t> message) = 0;
};

/// LCM. Its URL chooses the provider: `udpm://...` (UDP multicast), `memq://` (within the process), `file://...?mode=w` (a log).
class LcmTransport final : public MessageTransport {
 public:
  explicit LcmTransport(std::string url);
  ~LcmTransport() override;

  const std::string& description() const override { return url_; }
  Status open() override;
  Status send(const std::string& channel, std::span<const std::uint8_t> message) override;

  /// The instance of liblcm, to subscribe to a `memq://` of one's own; null before `open` succeeded.
  lcm::LCM* handle() { return lcm_.get(); }

 private:
  std::string url_;
  std::unique_ptr<lcm::LCM> lcm_;
};

}  // namespace posed
