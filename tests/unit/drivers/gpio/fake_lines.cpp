#include "tests/unit/drivers/gpio/fake_lines.h"

namespace posed {

class FakeChip::Line final : public GpioLine {
 public:
  Line(FakeChip& chip, int offset) : chip_(chip), offset_(offset) {}
  ~Line() override {
    const MutexLock lock(chip_.mutex_);
    --chip_.lines_held_;
  }
  Result<bool> is_active() override {
    const MutexLock lock(chip_.mutex_);
    if (const Status present = chip_.check(); !present) {
      return tl::unexpected<Error>(present.error());
    }
    return chip_.levels_[offset_];
  }
  Status set_active(bool active) override {
    const MutexLock lock(chip_.mutex_);
    const Status present = chip_.check();
    if (present) {
      chip_.write(offset_, active);
    }
    return present;
  }
  int event_fd() const override {
    const MutexLock lock(chip_.mutex_);
    return chip_.tells_events_ ? chip_.event_fd_.get() : -1;
  }
  Result<bool> take_events() override {
    const MutexLock lock(chip_.mutex_);
    if (const Status present = chip_.check(); !present) {
      return tl::unexpected<Error>(present.error());
    }
    eventfd_t count = 0;
    eventfd_read(chip_.event_fd_.get(), &count);
    return std::exchange(chip_.events_[offset_], 0) > 0 && chip_.tells_events_;
  }

 private:
  FakeChip& chip_;
  int offset_;
};

class FakeChip::Access final : public LineAccess {
 public:
  explicit Access(FakeChip& chip) : chip_(chip) {}
  Result<std::unique_ptr<GpioLine>> request(const LineRequest& request) override {
    const MutexLock lock(chip_.mutex_);
    chip_.requests_.push_back(chip_.clock_.now_ns());
    if (const Status present = chip_.check(); !present) {
      return tl::unexpected<Error>(present.error());
    }
    if (chip_.taken_.contains(request.offset)) {
      return make_error(ErrorCode::Unavailable, "line " + std::to_string(request.offset) + " is taken");
    }
    if (request.direction == LineDirection::Output) {
      chip_.write(request.offset, false);
    }
    ++chip_.lines_held_;
    return std::make_unique<Line>(chip_, request.offset);
  }

 private:
  FakeChip& chip_;
};

std::unique_ptr<LineAccess> FakeChip::access() {
  return std::make_unique<Access>(*this);
}

}  // namespace posed
