#pragma once

#include <atomic>
#include <cstdint>
#include <map>
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

  /// A message from outside, which the next `receive` hands on.
  template <typename T>
  void arrive(const std::string& channel, const T& value) {
    Message message{channel, std::vector<std::uint8_t>(static_cast<std::size_t>(value.getEncodedSize()))};
    value.encode(message.bytes.data(), 0, value.getEncodedSize());
    const std::lock_guard lock(mutex);
    arrived.push_back(std::move(message));
  }

  std::mutex mutex;
  std::vector<Message> messages;
  std::vector<Message> arrived;
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

  void subscribe(const std::string& channel, Handler handler) override { handlers_[channel] = std::move(handler); }

  void receive() override {
    std::vector<TransportLog::Message> arrived;
    {
      const std::lock_guard lock(log_->mutex);
      arrived = std::exchange(log_->arrived, {});
    }
    for (const TransportLog::Message& message : arrived) {
      if (const auto handler = handlers_.find(message.channel); handler != handlers_.end()) {
        handler->second(message.bytes);
      }
    }
  }

 private:
  std::map<std::string, Handler> handlers_;
  std::string url_ = "fake://";
  std::shared_ptr<TransportLog> log_;
};

}  // namespace posed
