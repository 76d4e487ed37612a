#include "drivers/libcamera/libcamera_device.h"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <libcamera/camera.h>
#include <libcamera/control_ids.h>
#include <libcamera/framebuffer_allocator.h>
#include <libcamera/request.h>
#include <linux/dma-buf.h>
#include <sys/ioctl.h>
#include <sys/mman.h>

#include "drivers/libcamera/libcamera_controls.h"
#include "drivers/libcamera/libcamera_manager.h"

namespace posed {

namespace {

YuvCoding coding_of(const std::optional<libcamera::ColorSpace>& space) {
  YuvCoding coding;
  if (space) {
    coding.matrix = space->ycbcrEncoding == libcamera::ColorSpace::YcbcrEncoding::Rec709 ? YuvMatrix::Bt709 : YuvMatrix::Bt601;
    coding.range = space->range == libcamera::ColorSpace::Range::Full ? YuvRange::Full : YuvRange::Limited;
  }
  return coding;
}

/// The memory of one buffer, mapped for reading.
class MappedBuffer {
 public:
  MappedBuffer() = default;
  MappedBuffer(MappedBuffer&& other) noexcept = default;
  MappedBuffer& operator=(MappedBuffer&&) = delete;
  ~MappedBuffer() {
    for (const auto& [descriptor, memory] : memory_) {
      munmap(memory.data(), memory.size());
    }
  }

  /// 0 or -errno.
  int map(const libcamera::FrameBuffer& buffer) {
    std::map<int, std::size_t> lengths;  // planes may share a descriptor
    for (const libcamera::FrameBuffer::Plane& plane : buffer.planes()) {
      std::size_t& length = lengths[plane.fd.get()];
      length = std::max<std::size_t>(length, std::size_t{plane.offset} + plane.length);
    }
    for (const auto& [descriptor, length] : lengths) {
      void* const memory = mmap(nullptr, length, PROT_READ, MAP_SHARED, descriptor, 0);
      if (memory == MAP_FAILED) {
        return -errno;
      }
      memory_[descriptor] = {static_cast<std::uint8_t*>(memory), length};
    }
    for (const libcamera::FrameBuffer::Plane& plane : buffer.planes()) {
      planes_.push_back(memory_[plane.fd.get()].subspan(plane.offset, plane.length));
    }
    return 0;
  }

  /// The planes of an image of this format; an error where they are too small for it.
  bool lay_out(const ColorFormat& format) {
    laid_out_.first = planes_.empty() ? std::span<const std::uint8_t>{} : planes_[0];
    laid_out_.second = planes_.size() > 1 ? planes_[1] : std::span<const std::uint8_t>{};
    if (format.layout == ColorLayout::Nv12 && planes_.size() == 1) {  // both in one
      const std::size_t luma = std::min(format.stride_bytes * static_cast<std::size_t>(format.height), laid_out_.first.size());
      laid_out_.second = laid_out_.first.subspan(luma);
    }
    return laid_out_.first.size() >= std::max<std::size_t>(1, least_first_bytes(format)) &&
           laid_out_.second.size() >= least_second_bytes(format);
  }

  const ColorPlanes& planes() const { return laid_out_; }

  /// Makes what the camera wrote visible to the processor, where caches do not see to that themselves. What is no DMA buffer
  /// refuses, and needs nothing of the kind.
  void sync(std::uint64_t flags) const {
    for (const auto& [descriptor, memory] : memory_) {
      dma_buf_sync request{flags | DMA_BUF_SYNC_READ};
      ioctl(descriptor, DMA_BUF_IOCTL_SYNC, &request);
    }
  }

 private:
  std::map<int, std::span<std::uint8_t>> memory_;  // by descriptor
  std::vector<std::span<const std::uint8_t>> planes_;
  ColorPlanes laid_out_;
};

class LibcameraDevice final : public ColorCamera {
 public:
  LibcameraDevice(const LibcameraConfig& config, const CameraIntrinsics& intrinsics, double rate_hz, const Clock& clock)
      : config_(config),
        width_(static_cast<unsigned>(intrinsics.width)),
        height_(static_cast<unsigned>(intrinsics.height)),
        rate_hz_(rate_hz),
        clock_(clock),
        description_(config.camera.empty() ? "libcamera camera, first one found" : "libcamera camera " + config.camera) {}
  ~LibcameraDevice() override { LibcameraDevice::close(); }

  const std::string& description() const override { return description_; }

  Status open(CompletionSink& sink) override {
    sink_ = &sink;
    Status opened = acquire();
    if (opened) {
      opened = configure();
    }
    if (opened) {
      opened = make_requests();
    }
    if (opened) {
      opened = start();
    }
    if (!opened) {
      close();
    }
    return opened;
  }

  void close() noexcept override {
    if (camera_) {
      camera_->stop();
      camera_->requestCompleted.disconnect(this);
      camera_->disconnected.disconnect(this);
    }
    requests_.clear();
    buffers_.clear();
    allocator_.reset();
    configuration_.reset();
    if (acquired_) {
      camera_->release();
      acquired_ = false;
    }
    camera_.reset();
  }

  const ColorFormat& format() const override { return format_; }
  TimeNs period_ns() const override { return period_ns_; }
  std::size_t buffers() const override { return buffers_.size(); }

  ColorPlanes planes(std::uint32_t buffer) const override {
    buffers_[buffer].sync(DMA_BUF_SYNC_START);
    return buffers_[buffer].planes();
  }

  Status give_back(std::uint32_t buffer) override {
    buffers_[buffer].sync(DMA_BUF_SYNC_END);
    requests_[buffer]->reuse(libcamera::Request::ReuseBuffers);
    if (const int error = camera_->queueRequest(requests_[buffer].get()); error != 0) {
      return libcamera_error(description_ + " takes no buffer back", error);
    }
    return {};
  }

 private:
  Status acquire() {
    const Result<libcamera::CameraManager*> manager = camera_manager();
    if (!manager) {
      return tl::unexpected<Error>(manager.error());
    }
    const std::vector<std::shared_ptr<libcamera::Camera>> cameras = (*manager)->cameras();
    const auto found = std::find_if(cameras.begin(), cameras.end(), [this](const std::shared_ptr<libcamera::Camera>& camera) {
      return config_.camera.empty() || camera->id() == config_.camera;
    });
    if (found == cameras.end()) {
      std::vector<std::string> ids;
      for (const std::shared_ptr<libcamera::Camera>& camera : cameras) {
        ids.push_back(camera->id());
      }
      return make_error(ErrorCode::NotFound, ids.empty() ? description_ + ": libcamera finds no camera"
                                                         : fmt::format("{}: libcamera does not find it; it finds {}", description_,
                                                                       fmt::join(ids, ", ")));
    }
    camera_ = *found;
    if (const int error = camera_->acquire(); error != 0) {
      return libcamera_error(description_ + " cannot be acquired", error);
    }
    acquired_ = true;
    camera_->requestCompleted.connect(this, &LibcameraDevice::on_request);
    camera_->disconnected.connect(this, &LibcameraDevice::on_disconnected);
    return {};
  }

  /// Takes the first format that the camera has in the size.
  Status configure() {
    configuration_ = camera_->generateConfiguration({libcamera::StreamRole::Viewfinder});
    if (!configuration_ || configuration_->empty()) {
      return make_error(ErrorCode::Unsupported, description_ + ": it has no stream for a viewfinder");
    }
    std::string refusal = "it has no format that posed reads";
    for (const ReadableFormat& wanted : readable_formats()) {
      const std::vector<libcamera::PixelFormat> offered = configuration_->at(0).formats().pixelformats();
      if (!offered.empty() && std::find(offered.begin(), offered.end(), wanted.format) == offered.end()) {
        continue;
      }
      const Result<ColorFormat> agreed = validate(wanted.format);
      if (!agreed) {
        refusal = agreed.error().message;
        continue;
      }
      format_ = *agreed;
      if (const int error = camera_->configure(configuration_.get()); error != 0) {
        return libcamera_error(description_ + " cannot be configured", error);
      }
      return {};
    }
    return make_error(ErrorCode::Unsupported, fmt::format("{}: {}", description_, refusal));
  }

  /// What libcamera makes of the wish; it changes what it cannot do.
  Result<ColorFormat> validate(const libcamera::PixelFormat& wanted) {
    libcamera::StreamConfiguration& stream = configuration_->at(0);
    stream.pixelFormat = wanted;
    stream.size = {width_, height_};
    stream.bufferCount = static_cast<unsigned>(config_.buffers);
    stream.stride = 0;
    if (configuration_->validate() == libcamera::CameraConfiguration::Invalid) {
      return make_error(ErrorCode::Unsupported, fmt::format("it does not deliver {}", wanted.toString()));
    }
    if (stream.size.width != width_ || stream.size.height != height_) {
      return make_error(
          ErrorCode::Unsupported,
          fmt::format("it delivers {}x{} pixels where the calibration has {}x{}: a calibration of that size is needed",
                      stream.size.width, stream.size.height, width_, height_));
    }
    const ReadableFormat* const agreed = find_readable(stream.pixelFormat);
    if (agreed == nullptr) {
      return make_error(ErrorCode::Unsupported,
                        fmt::format("it delivers {}, which posed does not read", stream.pixelFormat.toString()));
    }
    const bool is_yuv = agreed->layout == ColorLayout::Yuyv || agreed->layout == ColorLayout::Nv12;
    if (is_yuv && (width_ % 2 != 0 || height_ % 2 != 0)) {
      return make_error(ErrorCode::Unsupported, fmt::format("{} images must have an even size", stream.pixelFormat.toString()));
    }
    return ColorFormat{agreed->layout, static_cast<int>(width_), static_cast<int>(height_), stream.stride,
                       coding_of(stream.colorSpace)};
  }

  Status make_requests() {
    libcamera::Stream* const stream = configuration_->at(0).stream();
    allocator_ = std::make_unique<libcamera::FrameBufferAllocator>(camera_);
    if (const int count = allocator_->allocate(stream); count <= 0) {
      return libcamera_error(description_ + ": no buffers can be had", count < 0 ? count : -ENOMEM);
    }
    for (const std::unique_ptr<libcamera::FrameBuffer>& buffer : allocator_->buffers(stream)) {
      if (const int error = buffers_.emplace_back().map(*buffer); error != 0) {
        return libcamera_error(description_ + ": a buffer cannot be mapped", error);
      }
      if (!buffers_.back().lay_out(format_)) {
        return make_error(ErrorCode::Unsupported, description_ + ": its buffers are too small for its images");
      }
      std::unique_ptr<libcamera::Request> request = camera_->createRequest(requests_.size());
      if (!request || request->addBuffer(stream, buffer.get()) != 0) {
        return make_error(ErrorCode::Io, description_ + ": a request cannot be made");
      }
      requests_.push_back(std::move(request));
    }
    return {};
  }

  Status start() {
    Result<libcamera::ControlList> controls = parse_controls(camera_->controls(), config_.controls);
    if (!controls) {
      return make_error(controls.error().code, fmt::format("{}: {}", description_, controls.error().message));
    }
    period_ns_ = set_frame_period(camera_->controls(), from_seconds(1.0 / rate_hz_), *controls);
    if (const int error = camera_->start(&*controls); error != 0) {
      return libcamera_error(description_ + " does not start", error);
    }
    for (const std::unique_ptr<libcamera::Request>& request : requests_) {
      if (const int error = camera_->queueRequest(request.get()); error != 0) {
        return libcamera_error(description_ + " takes no request", error);
      }
    }
    return {};
  }

  /// On libcamera's thread.
  void on_request(libcamera::Request* request) {
    CompletedImage image;
    image.arrival_ns = clock_.now_ns();
    image.buffer = static_cast<std::uint32_t>(request->cookie());
    if (request->status() == libcamera::Request::RequestCancelled || request->buffers().empty()) {
      image.kind = CompletedImage::Kind::Cancelled;
      sink_->on_completed(image);
      return;
    }
    const libcamera::FrameMetadata& filled = request->buffers().begin()->second->metadata();
    image.kind =
        filled.status == libcamera::FrameMetadata::FrameSuccess ? CompletedImage::Kind::Filled : CompletedImage::Kind::Damaged;
    image.sequence = filled.sequence;
    // The sensor's stamp is of the exposure, the buffer's of when it was filled.
    image.stamp_ns =
        request->metadata().get(libcamera::controls::SensorTimestamp).value_or(static_cast<std::int64_t>(filled.timestamp));
    image.bytes_used = filled.planes().empty() ? 0 : filled.planes()[0].bytesused;
    sink_->on_completed(image);
  }

  void on_disconnected() { sink_->on_disconnected(); }

  LibcameraConfig config_;
  unsigned width_;
  unsigned height_;
  double rate_hz_;
  const Clock& clock_;
  std::string description_;

  CompletionSink* sink_ = nullptr;
  std::shared_ptr<libcamera::Camera> camera_;
  bool acquired_ = false;
  std::unique_ptr<libcamera::CameraConfiguration> configuration_;
  std::unique_ptr<libcamera::FrameBufferAllocator> allocator_;
  std::vector<MappedBuffer> buffers_;
  std::vector<std::unique_ptr<libcamera::Request>> requests_;  // one a buffer, by its number
  ColorFormat format_;
  TimeNs period_ns_ = 0;
};

}  // namespace

std::unique_ptr<ColorCamera> make_libcamera_device(const LibcameraConfig& config, const CameraIntrinsics& intrinsics,
                                                   double rate_hz, const Clock& clock) {
  return std::make_unique<LibcameraDevice>(config, intrinsics, rate_hz, clock);
}

}  // namespace posed
