#include "drivers/openni2/openni2_device.h"

#include <chrono>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "core/logging.h"
#include "drivers/openni2/openni2_devices.h"

namespace posed {

namespace {

constexpr float kStepped = -1.0F;  // playback speed: one image for each wait
constexpr int kPlayerBegins_ms = 2000;
constexpr std::chrono::milliseconds kPlayerRests{20};

std::string_view name_of(OpenNi2Device::Kind kind) {
  return kind == OpenNi2Device::Color ? "colour" : "depth";
}

openni::SensorType sensor_of(OpenNi2Device::Kind kind) {
  return kind == OpenNi2Device::Color ? openni::SENSOR_COLOR : openni::SENSOR_DEPTH;
}

std::string names_of(const openni::Array<openni::VideoMode>& modes) {
  std::vector<std::string> names;
  for (int i = 0; i < modes.getSize(); ++i) {
    names.push_back(openni2_mode_name(modes[i]));
  }
  return names.empty() ? "nothing" : fmt::format("{}", fmt::join(names, ", "));
}

void set_automatic(std::string_view what, const std::string& uri, openni::Status status) {
  if (status != openni::STATUS_OK) {
    log_warning("OpenNI2 camera '{}': automatic {} cannot be set: {}", uri, what, openni2_error());
  }
}

}  // namespace

OpenNi2Device::OpenNi2Device(const OpenNi2Config& config, const OpenNi2Wish& wish) : config_(config), wish_(wish) {
  static_cast<void>(runtime_.hold());  // where it fails, `open` tries again and tells
}

Status OpenNi2Device::open(bool frame_sync) {
  Status opened = open_all(frame_sync);
  if (!opened) {
    close();
  }
  return opened;
}

Status OpenNi2Device::open_all(bool frame_sync) {
  if (Status held = runtime_.hold(); !held) {
    return held;
  }
  Result<std::unique_ptr<OpenNi2Watch>> watch = open_openni2_device(config_.device, device_);
  if (!watch) {
    return tl::unexpected(std::move(watch.error()));
  }
  watch_ = *std::move(watch);
  if (Status started = device_.isFile() ? start_recording() : start_camera(frame_sync); !started) {
    return started;
  }
  // A thread's first wait makes things that later ones use.
  openni::VideoStream* none = nullptr;
  int ready = 0;
  openni::OpenNI::waitForAnyStream(&none, 1, &ready, openni::TIMEOUT_NONE);
  log_info("OpenNI2: {} {} '{}', {} and {}", device_.getDeviceInfo().getVendor(), device_.getDeviceInfo().getName(), watch_->uri(),
           openni2_mode_name(streams_[Color].mode), openni2_mode_name(streams_[Depth].mode));
  return {};
}

Status OpenNi2Device::start_camera(bool frame_sync) {
  for (const Kind kind : {Color, Depth}) {
    if (Status created = create(kind); !created) {
      return created;
    }
    if (Status chosen = choose_mode(kind); !chosen) {
      return chosen;
    }
    unmirror(streams_[kind]);
  }
  if (Status registered = register_depth(); !registered) {
    return registered;
  }
  set_automatics();
  for (const Kind kind : {Color, Depth}) {
    if (Status started = start(kind); !started) {
      return started;
    }
  }
  // Only now: OpenNI2 puts into the group of synchronous streams those that run.
  synced_ = frame_sync;
  if (synced_ && device_.setDepthColorSyncEnabled(true) != openni::STATUS_OK) {
    log_info("OpenNI2 camera '{}' has no frame synchronisation", watch_->uri());
  }
  return {};
}

Status OpenNi2Device::start_recording() {
  device_.getPlaybackControl()->setRepeatEnabled(false);
  device_.getPlaybackControl()->setSpeed(kStepped);
  Status fits;
  for (const Kind kind : {Color, Depth}) {
    Status started = create(kind);
    if (started) {
      streams_[kind].gate.close();
      streams_[kind].stream.setFrameBuffersAllocator(&streams_[kind].gate);
      started = start(kind).and_then([&] { return take_recorded_mode(kind); });
    }
    fits = fits ? started : fits;
  }
  // Whatever is wrong, the player is let begin: OpenNI2 waits three seconds for one that it closes before, and then kills its
  // thread.
  openni::VideoStream* streams[] = {&streams_[Color].stream, &streams_[Depth].stream};
  int ready = 0;
  if (openni::OpenNI::waitForAnyStream(streams, kKinds, &ready, kPlayerBegins_ms) != openni::STATUS_OK) {
    return make_error(ErrorCode::BadData, fmt::format("recording '{}' holds no image", watch_->uri()));
  }
  return fits;
}

Status OpenNi2Device::create(Kind kind) {
  if (!device_.hasSensor(sensor_of(kind))) {
    return make_error(ErrorCode::Unsupported, fmt::format("OpenNI2 device '{}' has no {} stream", watch_->uri(), name_of(kind)));
  }
  if (streams_[kind].stream.create(device_, sensor_of(kind)) != openni::STATUS_OK) {
    return make_error(ErrorCode::Io,
                      fmt::format("OpenNI2 device '{}': no {} stream: {}", watch_->uri(), name_of(kind), openni2_error()));
  }
  return {};
}

Status OpenNi2Device::choose_mode(Kind kind) {
  Stream& stream = streams_[kind];
  const openni::Array<openni::VideoMode>& offered = stream.stream.getSensorInfo().getSupportedVideoModes();
  const std::vector<openni::VideoMode> usable =
      kind == Color ? usable_color_modes(offered, wish_) : usable_depth_modes(offered, wish_);
  if (usable.empty()) {
    return make_error(
        ErrorCode::Unsupported,
        fmt::format("OpenNI2 camera '{}' offers no {} of the calibration's size, {}x{}, in a format known here; it offers {}",
                    watch_->uri(), name_of(kind), wish_.width, wish_.height, names_of(offered)));
  }
  if (stream.stream.isCroppingSupported()) {
    stream.stream.resetCropping();
  }
  std::string refusals;
  for (const openni::VideoMode& mode : usable) {
    if (stream.stream.setVideoMode(mode) == openni::STATUS_OK) {
      stream.mode = mode;
      return {};
    }
    refusals += fmt::format("; {}: {}", openni2_mode_name(mode), openni2_error());
  }
  return make_error(ErrorCode::Unsupported, fmt::format("OpenNI2 camera '{}' refuses every mode of {} that it offers{}",
                                                        watch_->uri(), name_of(kind), refusals));
}

Status OpenNi2Device::take_recorded_mode(Kind kind) {
  Stream& stream = streams_[kind];
  stream.mode = stream.stream.getVideoMode();
  const openni::PixelFormat format = stream.mode.getPixelFormat();
  if (stream.mode.getResolutionX() != wish_.width || stream.mode.getResolutionY() != wish_.height ||
      !(kind == Color ? is_usable_color(format) : is_usable_depth(format))) {
    return make_error(ErrorCode::Unsupported,
                      fmt::format("recording '{}' holds {} as {}; the calibration's size is {}x{}", watch_->uri(), name_of(kind),
                                  openni2_mode_name(stream.mode), wish_.width, wish_.height));
  }
  unmirror(stream);
  return {};
}

void OpenNi2Device::unmirror(Stream& stream) {
  if (stream.stream.isPropertySupported(openni::STREAM_PROPERTY_MIRRORING)) {
    stream.stream.setMirroringEnabled(false);
  }
  stream.mirrored = stream.stream.getMirroringEnabled();
}

Status OpenNi2Device::register_depth() {
  const openni::ImageRegistrationMode wanted =
      config_.registration ? openni::IMAGE_REGISTRATION_DEPTH_TO_COLOR : openni::IMAGE_REGISTRATION_OFF;
  if (!device_.isImageRegistrationModeSupported(wanted)) {
    if (!config_.registration) {
      return {};
    }
    return make_error(
        ErrorCode::Unsupported,
        fmt::format("OpenNI2 camera '{}' cannot register depth to colour, which posed needs; if its depth is registered as "
                    "it comes, set source.openni2.registration = false",
                    watch_->uri()));
  }
  if (device_.setImageRegistrationMode(wanted) != openni::STATUS_OK) {
    return make_error(ErrorCode::Unsupported, fmt::format("OpenNI2 camera '{}': registration of depth cannot be switched {}: {}",
                                                          watch_->uri(), config_.registration ? "on" : "off", openni2_error()));
  }
  return {};
}

void OpenNi2Device::set_automatics() {
  openni::VideoStream& color = streams_[Color].stream;
  openni::CameraSettings* settings = color.getCameraSettings();
  if (settings == nullptr) {
    return;
  }
  if (color.isPropertySupported(openni::STREAM_PROPERTY_AUTO_EXPOSURE)) {
    set_automatic("exposure", watch_->uri(), settings->setAutoExposureEnabled(config_.auto_exposure));
  }
  if (color.isPropertySupported(openni::STREAM_PROPERTY_AUTO_WHITE_BALANCE)) {
    set_automatic("white balance", watch_->uri(), settings->setAutoWhiteBalanceEnabled(config_.auto_white_balance));
  }
}

Status OpenNi2Device::start(Kind kind) {
  if (streams_[kind].stream.start() != openni::STATUS_OK) {
    return make_error(ErrorCode::Io,
                      fmt::format("OpenNI2 device '{}': {} does not start: {}", watch_->uri(), name_of(kind), openni2_error()));
  }
  streams_[kind].started = true;
  return {};
}

void OpenNi2Device::stop() noexcept {
  if (std::exchange(synced_, false)) {
    device_.setDepthColorSyncEnabled(false);
  }
  for (Stream& stream : streams_) {
    stream.gate.open();
    if (std::exchange(stream.started, false)) {
      stream.stream.stop();
    }
  }
}

void OpenNi2Device::close() noexcept {
  stop();
  if (device_.isValid() && device_.isFile()) {
    // The player looks through its streams without a lock, but for when it sleeps (10 ms) because none runs.
    std::this_thread::sleep_for(kPlayerRests);
  }
  for (Stream& stream : streams_) {
    stream.stream.destroy();
  }
  device_.close();
  watch_.reset();
}

}  // namespace posed
