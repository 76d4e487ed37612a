#include "tests/unit/drivers/libcamera/fake_color_camera.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace posed::test {

class FakeColorCamera::Handle final : public ColorCamera {
 public:
  explicit Handle(FakeColorCamera& camera) : camera_(camera) {}
  ~Handle() override {
    if (camera_.is_open()) {
      camera_.violation("destroyed while it was open");
    }
  }

  const std::string& description() const override { return description_; }

  Status open(CompletionSink& sink) override {
    if (camera_.is_open()) {
      camera_.violation("opened twice");
    }
    if (!camera_.present) {
      return make_error(ErrorCode::NotFound, "the colour camera is away");
    }
    ++camera_.opened_;
    camera_.sink_ = &sink;
    camera_.memory_.assign(camera_.buffers, std::vector<std::uint8_t>(least_first_bytes(camera_.format_)));
    camera_.is_queued_.assign(camera_.buffers, true);
    camera_.queued_.clear();
    for (std::uint32_t buffer = 0; buffer < camera_.buffers; ++buffer) {
      camera_.queued_.push_back(buffer);
    }
    camera_.sequence_ = 0;
    camera_.next_stamp_ns_ = (camera_.clock_.now_ns() / camera_.period_ns() + 1) * camera_.period_ns();
    return {};
  }

  void close() noexcept override {
    if (camera_.sink_ != nullptr) {
      for (const std::uint32_t buffer : std::exchange(camera_.queued_, {})) {
        camera_.sink_->on_completed({.kind = CompletedImage::Kind::Cancelled, .buffer = buffer});
      }
      camera_.sink_ = nullptr;
    }
  }

  const ColorFormat& format() const override { return camera_.format_; }
  TimeNs period_ns() const override { return camera_.period_ns(); }
  std::size_t buffers() const override { return camera_.buffers; }

  ColorPlanes planes(std::uint32_t buffer) const override {
    if (camera_.is_queued_[buffer]) {
      camera_.violation("a buffer is read that the camera has");
    }
    return {camera_.memory_[buffer], {}};
  }

  Status give_back(std::uint32_t buffer) override {
    if (!camera_.is_open() || camera_.is_queued_[buffer]) {
      camera_.violation("a buffer is given back that the camera has");
    }
    if (camera_.give_back_error) {
      return tl::unexpected<Error>(*camera_.give_back_error);
    }
    camera_.is_queued_[buffer] = true;
    camera_.queued_.push_back(buffer);
    return {};
  }

 private:
  FakeColorCamera& camera_;
  std::string description_ = "fake colour camera";
};

FakeColorCamera::FakeColorCamera(const Clock& clock, int width, int height)
    : clock_(clock), format_{ColorLayout::Bgr, width, height, static_cast<std::size_t>(3 * width + 5), {}} {}

std::unique_ptr<ColorCamera> FakeColorCamera::handle() {
  return std::make_unique<Handle>(*this);
}

TimeNs FakeColorCamera::next_ns() const {
  return is_open() && present ? next_stamp_ns_ + delay_ns : std::numeric_limits<TimeNs>::max();
}

void FakeColorCamera::run() {
  while (next_ns() <= clock_.now_ns()) {
    const TimeNs stamp_ns = next_stamp_ns_;
    next_stamp_ns_ += period_ns();
    const std::uint64_t sequence = sequence_++;
    const ColorFate image = fate(sequence);
    if (queued_.empty() || image.dropped || stamp_ns < silent_until_ns) {
      continue;
    }
    const std::uint32_t buffer = queued_.front();
    queued_.erase(queued_.begin());
    is_queued_[buffer] = false;
    std::fill(memory_[buffer].begin(), memory_[buffer].end(), static_cast<std::uint8_t>(sequence));
    sink_->on_completed({image.kind, buffer, sequence, stamp_ns + clock_offset_ns, clock_.now_ns(), memory_[buffer].size()});
  }
}

void FakeColorCamera::disconnect() {
  present = false;
  if (sink_ != nullptr) {
    sink_->on_disconnected();
  }
}

}  // namespace posed::test
