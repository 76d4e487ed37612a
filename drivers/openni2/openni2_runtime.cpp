#include "drivers/openni2/openni2_runtime.h"

#include <algorithm>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "core/mutex.h"
#include "drivers/openni2/openni2_api.h"

namespace posed {

/// Hands what OpenNI2's drivers tell to the watches. There is one for the life of the process: OpenNI2 may still be calling a
/// listener that has just been removed.
class OpenNi2Listener final : public openni::OpenNI::DeviceDisconnectedListener, public openni::OpenNI::DeviceStateChangedListener {
 public:
  static OpenNi2Listener& instance() {
    static OpenNi2Listener listener;
    return listener;
  }

  void add(OpenNi2Watch& watch) {
    MutexLock lock(mutex_);
    watches_.push_back(&watch);
  }

  void remove(OpenNi2Watch& watch) {
    MutexLock lock(mutex_);
    std::erase(watches_, &watch);
  }

 private:
  void onDeviceDisconnected(const openni::DeviceInfo* info) override { raise(info, &OpenNi2Watch::disconnected_); }

  void onDeviceStateChanged(const openni::DeviceInfo* info, openni::DeviceState state) override {
    switch (state) {
      case openni::DEVICE_STATE_ERROR: raise(info, &OpenNi2Watch::failed_); break;
      case openni::DEVICE_STATE_EOF: raise(info, &OpenNi2Watch::ended_); break;
      case openni::DEVICE_STATE_OK:
      case openni::DEVICE_STATE_NOT_READY: break;  // it goes on; if it does not, the source finds it silent
    }
  }

  void raise(const openni::DeviceInfo* info, std::atomic<bool> OpenNi2Watch::*flag) {
    MutexLock lock(mutex_);
    for (OpenNi2Watch* watch : watches_) {
      if (watch->uri() == info->getUri()) {
        (watch->*flag).store(true, std::memory_order_release);
      }
    }
  }

  Mutex mutex_;
  std::vector<OpenNi2Watch*> watches_ POSED_GUARDED_BY(mutex_);
};

namespace {

Mutex runtime_mutex;
int holders POSED_GUARDED_BY(runtime_mutex) = 0;

}  // namespace

OpenNi2Runtime::~OpenNi2Runtime() {
  if (!holds_) {
    return;
  }
  MutexLock lock(runtime_mutex);
  if (--holders == 0) {
    openni::OpenNI::removeDeviceDisconnectedListener(&OpenNi2Listener::instance());
    openni::OpenNI::removeDeviceStateChangedListener(&OpenNi2Listener::instance());
    openni::OpenNI::shutdown();
  }
}

Status OpenNi2Runtime::hold() {
  if (holds_) {
    return {};
  }
  MutexLock lock(runtime_mutex);
  if (holders == 0) {
    if (openni::OpenNI::initialize() != openni::STATUS_OK) {
      std::string reason = openni2_error();
      openni::OpenNI::shutdown();  // it counts failures to initialise, too
      return make_error(ErrorCode::Unavailable, fmt::format("OpenNI2 cannot be initialised: {}", reason));
    }
    openni::OpenNI::addDeviceDisconnectedListener(&OpenNi2Listener::instance());
    openni::OpenNI::addDeviceStateChangedListener(&OpenNi2Listener::instance());
  }
  ++holders;
  holds_ = true;
  return {};
}

OpenNi2Watch::OpenNi2Watch(std::string uri) : uri_(std::move(uri)) {
  OpenNi2Listener::instance().add(*this);
}

OpenNi2Watch::~OpenNi2Watch() {
  OpenNi2Listener::instance().remove(*this);
}

std::string openni2_error() {
  std::string text = openni::OpenNI::getExtendedError();
  std::replace(text.begin(), text.end(), '\n', ' ');
  while (!text.empty() && text.back() == ' ') {
    text.pop_back();
  }
  return text.empty() ? "no reason given" : text;
}

}  // namespace posed
