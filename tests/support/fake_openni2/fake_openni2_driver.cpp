#include <algorithm>
#include <cstring>
#include <map>
#include <memory>
#include <mutex>

#include "tests/support/fake_openni2/fake_openni2.h"

// What OniDriverAPI.h expects of a library of OpenNI2's that Debian does not package.
#define XN_NEW(type, ...) new type(__VA_ARGS__)
#define XN_DELETE(object) delete (object)
#include <Driver/OniDriverAPI.h>

namespace posed::test {

namespace {

template <typename T>
OniStatus put(const T& value, void* data, int* size) {
  if (*size < static_cast<int>(sizeof(T))) {
    return ONI_STATUS_BAD_PARAMETER;
  }
  std::memcpy(data, &value, sizeof(T));
  *size = static_cast<int>(sizeof(T));
  return ONI_STATUS_OK;
}

template <typename T>
T get(const void* data) {
  T value;
  std::memcpy(&value, data, sizeof(T));
  return value;
}

class Stream;

/// A camera as the test knows it; it stays known when it is unplugged.
struct Known {
  FakeOpenNi2Camera camera;
  FakeOpenNi2State state;
  bool plugged = false;
  Stream* color = nullptr;
  Stream* depth = nullptr;
  OniDeviceInfo info{};
  std::vector<OniSensorInfo> sensors;  // OpenNI2 keeps pointers to these

  void set(const FakeOpenNi2Camera& as) {
    camera = as;
    sensors.clear();
    add_sensor(ONI_SENSOR_COLOR, camera.color_modes);
    add_sensor(ONI_SENSOR_DEPTH, camera.depth_modes);
  }

  Stream*& stream(OniSensorType sensor) { return sensor == ONI_SENSOR_COLOR ? color : depth; }
  OniVideoMode& mode(OniSensorType sensor) { return sensor == ONI_SENSOR_COLOR ? state.color_mode : state.depth_mode; }
  bool& runs(OniSensorType sensor) { return sensor == ONI_SENSOR_COLOR ? state.color_runs : state.depth_runs; }
  bool& mirrored(OniSensorType sensor) { return sensor == ONI_SENSOR_COLOR ? state.color_mirrored : state.depth_mirrored; }

 private:
  void add_sensor(OniSensorType sensor, std::vector<OniVideoMode>& modes) {
    if (!modes.empty()) {
      sensors.push_back({sensor, static_cast<int>(modes.size()), modes.data()});
      mode(sensor) = modes.front();
    }
  }
};

class Driver;

class Fake final : public FakeOpenNi2 {
 public:
  static Fake& instance() {
    static Fake fake;
    return fake;
  }

  void reset() override {
    const std::lock_guard lock(mutex);
    known.clear();
  }
  void plug(const FakeOpenNi2Camera& camera) override;
  void change(const FakeOpenNi2Camera& camera) override {
    const std::lock_guard lock(mutex);
    known.at(camera.uri)->set(camera);
  }
  void unplug(const std::string& uri) override;
  void fail(const std::string& uri) override;
  bool push(const std::string& uri, OniSensorType sensor, const FakeOpenNi2Image& image) override;
  FakeOpenNi2State state(const std::string& uri) override {
    const std::lock_guard lock(mutex);
    return known.at(uri)->state;
  }
  bool initialised() override {
    const std::lock_guard lock(mutex);
    return driver != nullptr;
  }

  std::recursive_mutex mutex;  // a driver's call back into OpenNI2 may come back here
  std::map<std::string, std::unique_ptr<Known>> known;
  Driver* driver = nullptr;
};

class Stream final : public oni::driver::StreamBase {
 public:
  Stream(Known& owner, OniSensorType sensor) : owner_(owner), sensor_(sensor) {}

  OniBool isPropertySupported(int id) override {
    const bool automatic = id == ONI_STREAM_PROPERTY_AUTO_EXPOSURE || id == ONI_STREAM_PROPERTY_AUTO_WHITE_BALANCE;
    return id == ONI_STREAM_PROPERTY_VIDEO_MODE || id == ONI_STREAM_PROPERTY_MIRRORING || id == ONI_STREAM_PROPERTY_CROPPING ||
           (automatic && sensor_ == ONI_SENSOR_COLOR);
  }

  OniStatus getProperty(int id, void* data, int* size) override {
    const std::lock_guard lock(Fake::instance().mutex);
    constexpr float kFieldOfView = 1.0F;
    switch (id) {
      case ONI_STREAM_PROPERTY_VIDEO_MODE: return put(owner_.mode(sensor_), data, size);
      case ONI_STREAM_PROPERTY_MIRRORING: return put<OniBool>(owner_.mirrored(sensor_) ? TRUE : FALSE, data, size);
      case ONI_STREAM_PROPERTY_CROPPING: return put(OniCropping{}, data, size);
      case ONI_STREAM_PROPERTY_STRIDE: return put(stride(), data, size);
      case ONI_STREAM_PROPERTY_HORIZONTAL_FOV:
      case ONI_STREAM_PROPERTY_VERTICAL_FOV: return put(kFieldOfView, data, size);
      case ONI_STREAM_PROPERTY_MAX_VALUE: return put(10'000, data, size);
      default: return ONI_STATUS_NOT_SUPPORTED;
    }
  }

  OniStatus setProperty(int id, const void* data, int /*size*/) override {
    const std::lock_guard lock(Fake::instance().mutex);
    switch (id) {
      case ONI_STREAM_PROPERTY_VIDEO_MODE: return set_mode(get<OniVideoMode>(data));
      case ONI_STREAM_PROPERTY_MIRRORING:
        if (!owner_.camera.can_unmirror) {
          return ONI_STATUS_ERROR;
        }
        owner_.mirrored(sensor_) = get<OniBool>(data) != FALSE;
        return ONI_STATUS_OK;
      case ONI_STREAM_PROPERTY_CROPPING: return ONI_STATUS_OK;
      case ONI_STREAM_PROPERTY_AUTO_EXPOSURE: owner_.state.auto_exposure = get<OniBool>(data) != FALSE; return ONI_STATUS_OK;
      case ONI_STREAM_PROPERTY_AUTO_WHITE_BALANCE:
        owner_.state.auto_white_balance = get<OniBool>(data) != FALSE;
        return ONI_STATUS_OK;
      default: return ONI_STATUS_NOT_SUPPORTED;
    }
  }

  // A recorder asks for these and writes them down.
  void notifyAllProperties() override {
    const OniVideoMode mode = owner_.mode(sensor_);
    raisePropertyChanged(ONI_STREAM_PROPERTY_VIDEO_MODE, &mode, sizeof mode);
    const OniBool mirrored = owner_.mirrored(sensor_) ? TRUE : FALSE;
    raisePropertyChanged(ONI_STREAM_PROPERTY_MIRRORING, &mirrored, sizeof mirrored);
    const OniCropping cropping{};  // without which the player delivers nothing
    raisePropertyChanged(ONI_STREAM_PROPERTY_CROPPING, &cropping, sizeof cropping);
  }

  OniStatus start() override {
    const std::lock_guard lock(Fake::instance().mutex);
    if (!(sensor_ == ONI_SENSOR_COLOR ? owner_.camera.color_starts : owner_.camera.depth_starts)) {
      return ONI_STATUS_ERROR;
    }
    owner_.runs(sensor_) = true;
    return ONI_STATUS_OK;
  }

  void stop() override {
    const std::lock_guard lock(Fake::instance().mutex);
    owner_.runs(sensor_) = false;
  }

  void deliver(const FakeOpenNi2Image& image) {
    OniFrame* frame = getServices().acquireFrame();
    frame->dataSize = std::min(image.bytes, frame->dataSize);
    std::memcpy(frame->data, image.data, static_cast<std::size_t>(frame->dataSize));
    frame->sensorType = sensor_;
    frame->timestamp = image.timestamp_us;
    frame->frameIndex = image.index;
    frame->width = image.width;
    frame->height = image.height;
    frame->stride = image.stride;
    frame->videoMode = owner_.mode(sensor_);
    frame->croppingEnabled = FALSE;
    frame->cropOriginX = frame->cropOriginY = 0;
    raiseNewFrame(frame);
    getServices().releaseFrame(frame);
  }

  OniSensorType sensor() const { return sensor_; }
  Known& owner() { return owner_; }

 private:
  int stride() const {
    const OniVideoMode& mode = owner_.mode(sensor_);
    switch (mode.pixelFormat) {
      case ONI_PIXEL_FORMAT_RGB888: return 3 * mode.resolutionX;
      case ONI_PIXEL_FORMAT_GRAY8: return mode.resolutionX;
      default: return 2 * mode.resolutionX;
    }
  }

  OniStatus set_mode(const OniVideoMode& mode) {
    const std::vector<int>& refused = owner_.camera.refused_formats;
    if (std::find(refused.begin(), refused.end(), mode.pixelFormat) != refused.end()) {
      return ONI_STATUS_BAD_PARAMETER;
    }
    owner_.mode(sensor_) = mode;
    return ONI_STATUS_OK;
  }

  Known& owner_;
  const OniSensorType sensor_;
};

class Device final : public oni::driver::DeviceBase {
 public:
  explicit Device(Known& known) : known_(known) {}

  Known& known() { return known_; }

  OniStatus getSensorInfoList(OniSensorInfo** sensors, int* count) override {
    *sensors = known_.sensors.data();
    *count = static_cast<int>(known_.sensors.size());
    return ONI_STATUS_OK;
  }

  oni::driver::StreamBase* createStream(OniSensorType sensor) override {
    const std::lock_guard lock(Fake::instance().mutex);
    ++known_.state.streams;
    return known_.stream(sensor) = new Stream(known_, sensor);
  }

  void destroyStream(oni::driver::StreamBase* stream) override {
    const std::lock_guard lock(Fake::instance().mutex);
    --known_.state.streams;
    known_.stream(static_cast<Stream*>(stream)->sensor()) = nullptr;
    delete stream;
  }

  OniBool isPropertySupported(int id) override {
    return id == ONI_DEVICE_PROPERTY_SERIAL_NUMBER || id == ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION;
  }

  OniStatus getProperty(int id, void* data, int* size) override {
    if (id == ONI_DEVICE_PROPERTY_SERIAL_NUMBER && *size > static_cast<int>(known_.camera.serial.size())) {
      std::memcpy(data, known_.camera.serial.c_str(), known_.camera.serial.size() + 1);
      return ONI_STATUS_OK;
    }
    return ONI_STATUS_NOT_SUPPORTED;
  }

  OniStatus setProperty(int id, const void* data, int /*size*/) override {
    if (id != ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION) {
      return ONI_STATUS_NOT_SUPPORTED;
    }
    const std::lock_guard lock(Fake::instance().mutex);
    known_.state.registration = get<int>(data);
    return ONI_STATUS_OK;
  }

  OniBool isImageRegistrationModeSupported(OniImageRegistrationMode mode) override {
    return mode == ONI_IMAGE_REGISTRATION_OFF || known_.camera.can_register;
  }

 private:
  Known& known_;
};

class Driver final : public oni::driver::DriverBase {
 public:
  explicit Driver(OniDriverServices* services) : DriverBase(services) {}

  OniStatus initialize(oni::driver::DeviceConnectedCallback connected, oni::driver::DeviceDisconnectedCallback disconnected,
                       oni::driver::DeviceStateChangedCallback state_changed, void* cookie) override {
    DriverBase::initialize(connected, disconnected, state_changed, cookie);
    Fake& fake = Fake::instance();
    const std::lock_guard lock(fake.mutex);
    fake.driver = this;
    for (auto& [uri, known] : fake.known) {
      if (known->plugged) {
        announce(known->info);
      }
    }
    return ONI_STATUS_OK;
  }

  void shutdown() override {
    const std::lock_guard lock(Fake::instance().mutex);
    Fake::instance().driver = nullptr;
  }

  oni::driver::DeviceBase* deviceOpen(const char* uri, const char* /*mode*/) override {
    Fake& fake = Fake::instance();
    const std::lock_guard lock(fake.mutex);
    const auto found = fake.known.find(uri);
    if (found == fake.known.end() || !found->second->plugged || found->second->camera.busy) {
      getServices().errorLoggerAppend("the fake camera cannot be opened");
      return nullptr;
    }
    ++found->second->state.times_opened;
    return new Device(*found->second);
  }

  void deviceClose(oni::driver::DeviceBase* device) override {
    const std::lock_guard lock(Fake::instance().mutex);
    ++static_cast<Device*>(device)->known().state.times_closed;
    delete device;
  }

  void* enableFrameSync(oni::driver::StreamBase** streams, int count) override {
    Known& owner = static_cast<Stream*>(streams[0])->owner();
    const std::lock_guard lock(Fake::instance().mutex);
    owner.state.synced_streams = count;
    return owner.camera.can_sync ? &owner : nullptr;
  }

  void disableFrameSync(void* group) override {
    const std::lock_guard lock(Fake::instance().mutex);
    static_cast<Known*>(group)->state.synced_streams = 0;
  }

  void announce(const OniDeviceInfo& info) { deviceConnected(&info); }
  void withdraw(const OniDeviceInfo& info) { deviceDisconnected(&info); }
  void report_failure(const OniDeviceInfo& info) { deviceStateChanged(&info, ONI_DEVICE_STATE_ERROR); }
};

void Fake::plug(const FakeOpenNi2Camera& camera) {
  const std::lock_guard lock(mutex);
  std::unique_ptr<Known>& slot = known[camera.uri];
  if (slot == nullptr) {
    slot = std::make_unique<Known>();
    std::strncpy(slot->info.uri, camera.uri.c_str(), ONI_MAX_STR - 1);
    std::strncpy(slot->info.vendor, "posed", ONI_MAX_STR - 1);
    std::strncpy(slot->info.name, "fake camera", ONI_MAX_STR - 1);
  }
  slot->set(camera);
  slot->plugged = true;
  if (driver != nullptr) {
    driver->announce(slot->info);
  }
}

void Fake::unplug(const std::string& uri) {
  const std::lock_guard lock(mutex);
  known.at(uri)->plugged = false;
  if (driver != nullptr) {
    driver->withdraw(known.at(uri)->info);
  }
}

void Fake::fail(const std::string& uri) {
  const std::lock_guard lock(mutex);
  if (driver != nullptr) {
    driver->report_failure(known.at(uri)->info);
  }
}

bool Fake::push(const std::string& uri, OniSensorType sensor, const FakeOpenNi2Image& image) {
  const std::lock_guard lock(mutex);
  Known& camera = *known.at(uri);
  Stream* stream = camera.stream(sensor);
  if (!camera.plugged || stream == nullptr || !camera.runs(sensor)) {
    return false;
  }
  stream->deliver(image);
  return true;
}

}  // namespace

}  // namespace posed::test

ONI_EXPORT_DRIVER(posed::test::Driver)

extern "C" ONI_API_EXPORT posed::test::FakeOpenNi2* fake_openni2() {
  return &posed::test::Fake::instance();
}
