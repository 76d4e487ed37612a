#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "daemon/message_transport.h"

namespace posed {

/// Remembers what was sent; refuses when told to. Its state is shared with the test. Thread-safe.
struct TransportLog {
  struct Message {
    std::string channel;
    std::vector<std::uint8_t> bytes;
  };

  void append(const std::string& channel, std::span<const std::uint8_t> bytes) {
    const std::lock_guard lock(mutex);
    messages.push_back({channel, {bytes.begin(), bytes.end()}});
  }

  /// All messages of a channel, decoded.
  template <typename T>
  std::vector<T> decoded(const std::string& channel) {
    const std::lock_guard lock(mutex);
    std::vector<T> result;
    for (const Message& message : messages) {
      if (message.channel == channel) {
        T value;
        if (value.decode(message.bytes.data(), 0, static_cast<int>(message.bytes.size())) > 0) {
          result.push_back(value);
        }
      }
    }
    return result;
  }

  std::mutex mutex;
  std::vector<Message> messages;
  std::atomic<int> opens{0};
  std::atomic<int> opens_to_refuse{0};
  std::atomic<bool> refuse_sends{false};
};

class FakeTransport final : public MessageTransport {
 public:
  explicit FakeTransport(std::shared_ptr<TransportLog> log) : log_(std::move(log)) {}

  const std::string& description() const override { return url_; }

  Status open() override {
    log_->opens++;
    if (log_->opens_to_refuse > 0) {
      log_->opens_to_refuse--;
      return make_error(ErrorCode::Unavailable, "no multicast route (fake)");
    }
    return {};
  }

  Status send(const std::string& channel, std::span<const std::uint8_t> message) override {
    if (log_->refuse_sends) {
      return make_error(ErrorCode::Io, "refused (fake)");
    }
    log_->append(channel, message);
    return {};
  }

 private:
  std::string url_ = "fake://";
  std::shared_ptr<TransportLog> log_;
};

}  // namespace posed
