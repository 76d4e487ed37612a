#include "drivers/v4l2/v4l2_stream.h"

#include <algorithm>
#include <cerrno>
#include <utility>

#include <fmt/format.h>

#include "drivers/v4l2/v4l2_controls.h"

namespace posed {

namespace {

constexpr std::size_t kFewestBuffers = 2;  // one to fill, one to read

v4l2_buffer buffer_request(std::uint32_t index) {
  v4l2_buffer buffer{};
  buffer.index = index;
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  return buffer;
}

}  // namespace

V4l2Stream::V4l2Stream(V4l2System& system, const Clock& clock, const V4l2Config& config, const V4l2Request& request)
    : clock_(clock), config_(config), request_(request), device_(system, config.device) {
  request_.format = config_.format;
}

Status V4l2Stream::open() {
  close();
  Status started = device_.open().and_then([&] { return start(); });
  if (!started) {
    close();
  }
  return started;
}

Status V4l2Stream::start() {
  if (Status capture = check_capture_node(device_); !capture) {
    return capture;
  }
  Result<V4l2Layout> layout = negotiate_format(device_, request_);
  if (!layout) {
    return tl::unexpected(std::move(layout).error());
  }
  layout_ = *layout;
  period_ns_ = negotiate_period(device_, request_.rate_hz);
  if (Status set = set_controls(device_, config_.controls); !set) {
    return set;
  }
  if (Status mapped = map_buffers(); !mapped) {
    return mapped;
  }
  for (std::uint32_t i = 0; i < buffers_.size(); ++i) {
    if (const int queued = queue(i); queued < 0) {
      return device_.failure("QBUF", queued);
    }
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (const int on = device_.ioctl(VIDIOC_STREAMON, &type); on < 0) {
    return device_.failure("STREAMON", on);
  }
  stamps_.restart();
  sequence_ = 0;
  any_ = false;
  failed_ = 0;
  hung_up_ = false;
  return {};
}

Status V4l2Stream::map_buffers() {
  v4l2_requestbuffers request{};
  request.count = static_cast<std::uint32_t>(config_.buffers);
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (const int done = device_.ioctl(VIDIOC_REQBUFS, &request); done < 0) {
    return device_.failure(fmt::format("REQBUFS of {} buffers", config_.buffers), done);
  }
  if (request.count < kFewestBuffers) {
    return device_.unsupported(fmt::format("asked for {} buffers, the driver gives {}", config_.buffers, request.count));
  }
  for (std::uint32_t i = 0; i < request.count; ++i) {
    v4l2_buffer buffer = buffer_request(i);
    if (const int done = device_.ioctl(VIDIOC_QUERYBUF, &buffer); done < 0) {
      return device_.failure("QUERYBUF", done);
    }
    if (buffer.length < std::max(layout_.image_bytes, std::size_t{1})) {
      return device_.unsupported(
          fmt::format("the driver's buffers have {} bytes, an image takes {}", buffer.length, layout_.image_bytes));
    }
    void* address = nullptr;
    if (const int done = device_.system().map(device_.descriptor(), buffer.length, buffer.m.offset, &address); done < 0) {
      return device_.failure("mmap", done);
    }
    buffers_.push_back({address, buffer.length, false, {}});
  }
  return {};
}

void V4l2Stream::close() noexcept {
  if (device_.descriptor() >= 0) {
    // Closing the node ends all this by itself; but a program that holds a copy of the descriptor would keep it alive.
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    device_.ioctl(VIDIOC_STREAMOFF, &type);
  }
  for (const Buffer& buffer : buffers_) {
    device_.system().unmap(buffer.address, buffer.length);
  }
  buffers_.clear();
  device_.close();
}

int V4l2Stream::queue(std::uint32_t buffer) {
  v4l2_buffer request = buffer_request(buffer);
  const int done = device_.ioctl(VIDIOC_QBUF, &request);
  buffers_[buffer].queued = done >= 0;
  return done;
}

V4l2Take V4l2Stream::take() {
  if (failed_ < 0) {
    return gone("QBUF", failed_);
  }
  v4l2_buffer filled = buffer_request(0);
  const int done = device_.ioctl(VIDIOC_DQBUF, &filled);
  if (done == -EAGAIN) {
    if (hung_up_) {  // poll tells that nothing more will come; DQBUF need not
      return {CameraReadKind::Gone, {}, {ErrorCode::NotFound, fmt::format("{}: the device hung up", path())}};
    }
    return {};
  }
  if (done < 0) {
    return gone("DQBUF", done);
  }
  if (filled.index >= buffers_.size() || !buffers_[filled.index].queued) {
    return gone("DQBUF of a buffer that was not queued", -EIO);
  }
  buffers_[filled.index].queued = false;
  V4l2Take took = check(filled);
  if (took.kind != CameraReadKind::Frame) {
    give_back(filled.index);
  }
  return took;
}

V4l2Take V4l2Stream::check(const v4l2_buffer& filled) {
  sequence_ = any_ ? sequence_ + (filled.sequence - static_cast<std::uint32_t>(sequence_)) : filled.sequence;
  any_ = true;
  const auto bad = [&](std::string_view reason) {
    return V4l2Take{CameraReadKind::BadFrame, {}, {ErrorCode::BadData, fmt::format("{}: image {}: {}", path(), sequence_, reason)}};
  };
  // A bad image's stamp may be bad too, so it must not disturb the clock.
  if ((filled.flags & V4L2_BUF_FLAG_ERROR) != 0) {
    return bad("the driver flags it as damaged");
  }
  Buffer& buffer = buffers_[filled.index];
  if (filled.bytesused < std::max(layout_.image_bytes, std::size_t{1}) || filled.bytesused > buffer.length) {
    return bad(fmt::format("{} bytes of {} were filled", filled.bytesused, layout_.image_bytes));
  }
  Result<TimeNs> capture_ns = stamps_.time_of(filled, clock_.now_ns());
  if (!capture_ns) {
    return bad(capture_ns.error().message);
  }
  buffer.image = {{static_cast<const std::uint8_t*>(buffer.address), filled.bytesused}, *capture_ns, sequence_, filled.index};
  return {CameraReadKind::Frame, buffer.image, {}};
}

V4l2Take V4l2Stream::wait(TimeNs timeout_ns) {
  pollfd node{device_.descriptor(), POLLIN, 0};
  const int ready = device_.system().poll({&node, 1}, timeout_ns);
  if (ready < 0) {
    return gone("poll", ready);
  }
  if (ready == 0) {
    return {};
  }
  note_poll(node.revents);
  return take();
}

void V4l2Stream::note_poll(short revents) {
  hung_up_ = hung_up_ || (revents & (POLLERR | POLLHUP | POLLNVAL)) != 0;
}

void V4l2Stream::give_back(std::uint32_t buffer) {
  if (const int queued = queue(buffer); queued < 0 && failed_ == 0) {
    failed_ = queued;
  }
}

V4l2Image V4l2Stream::image_in(std::uint32_t buffer) const {
  return buffers_[buffer].image;
}

V4l2Take V4l2Stream::gone(const char* action, int error) const {
  return {CameraReadKind::Gone, {}, device_.failure(action, error).value()};
}

}  // namespace posed
