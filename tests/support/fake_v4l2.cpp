#include "tests/support/fake_v4l2.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <tuple>
#include <unistd.h>

#include <sys/mman.h>

namespace posed::test {

namespace {

constexpr std::size_t kPage = 4096;

std::uint32_t bytes_per_pixel(std::uint32_t fourcc) {
  switch (fourcc) {
    case V4L2_PIX_FMT_RGB24:
    case V4L2_PIX_FMT_BGR24: return 3;
    case V4L2_PIX_FMT_BGR32: return 4;
    case V4L2_PIX_FMT_GREY:
    case V4L2_PIX_FMT_NV12: return 1;
    case V4L2_PIX_FMT_MJPEG: return 0;
    default: return 2;
  }
}

template <typename Bytes>
void copy_text(Bytes& to, const std::string& text) {
  std::memset(to, 0, sizeof to);
  std::memcpy(to, text.data(), std::min(text.size(), sizeof to - 1));
}

bool is_capture(std::uint32_t type) {
  return type == V4L2_BUF_TYPE_VIDEO_CAPTURE;
}

}  // namespace

FakeKernel::~FakeKernel() {
  for (const auto& [address, mapping] : mappings_) {
    ::munmap(address, mapping.length);
  }
  for (const auto& [descriptor, file] : files_) {
    ::close(descriptor);
  }
}

FakeCamera& FakeKernel::plug(const std::string& path, FakeCamera camera) {
  auto node = std::make_unique<Node>();
  node->camera = std::move(camera);
  return (nodes_[path] = std::move(node))->camera;
}

void FakeKernel::unplug(const std::string& path) {
  Node& node = *nodes_.at(path);
  node.present = false;
  node.owner = -1;
  ++node.generation;
}

void FakeKernel::replug(const std::string& path) {
  nodes_.at(path)->present = true;
}

void FakeKernel::silence(const std::string& path, TimeNs until_ns) {
  nodes_.at(path)->silent_until_ns = until_ns;
}

void FakeKernel::break_streaming(const std::string& path, int error) {
  for (auto& [descriptor, file] : files_) {
    file.broken = file.node == nodes_.at(path).get() ? error : file.broken;
  }
}

void FakeKernel::refuse(const std::string& path, unsigned long request, int error) {
  nodes_.at(path)->refusals.emplace_back(request, error);
}

void FakeKernel::count_from(const std::string& path, std::uint64_t sequence) {
  nodes_.at(path)->first_sequence = sequence;
}

std::size_t FakeKernel::queued_buffers(const std::string& path) const {
  std::size_t queued = 0;
  for (const auto& [descriptor, file] : files_) {
    queued += file.node == nodes_.at(path).get() ? file.queued.size() : 0;
  }
  return queued;
}

int FakeKernel::take_refusal(Node& node, unsigned long request) {
  const auto refusal =
      std::find_if(node.refusals.begin(), node.refusals.end(), [&](const auto& candidate) { return candidate.first == request; });
  if (refusal == node.refusals.end()) {
    return 0;
  }
  const int error = refusal->second;
  node.refusals.erase(refusal);
  return error;
}

int FakeKernel::open(const char* path) {
  const auto node = nodes_.find(path);
  if (node == nodes_.end() || !node->second->present) {
    return -ENOENT;
  }
  if (const int error = take_refusal(*node->second, 0); error != 0) {
    return -error;
  }
  const int descriptor = ::memfd_create("fake-v4l2", MFD_CLOEXEC);
  if (descriptor < 0) {
    return -errno;
  }
  File file;
  file.node = node->second.get();
  file.generation = file.node->generation;
  files_.emplace(descriptor, std::move(file));
  return descriptor;
}

int FakeKernel::close(int descriptor) {
  const auto file = files_.find(descriptor);
  if (file == files_.end()) {
    violation("close of a descriptor that is not open");
    return -EBADF;
  }
  if (file->second.node->owner == descriptor) {
    file->second.node->owner = -1;
  }
  files_.erase(file);
  ::close(descriptor);
  return 0;
}

int FakeKernel::ioctl(int descriptor, unsigned long request, void* argument) {
  const auto found = files_.find(descriptor);
  if (found == files_.end()) {
    violation("ioctl on a descriptor that is not open");
    return -EBADF;
  }
  File& file = found->second;
  if (!is_alive(file)) {
    return -ENODEV;
  }
  if (const int error = take_refusal(*file.node, request); error != 0) {
    return -error;
  }
  switch (request) {
    case VIDIOC_QUERYCAP: {
      auto& capability = *static_cast<v4l2_capability*>(argument);
      capability = {};
      copy_text(capability.driver, "fake");
      copy_text(capability.card, file.node->camera.card);
      copy_text(capability.bus_info, "usb-fake");
      capability.device_caps = file.node->camera.capabilities;
      capability.capabilities = V4L2_CAP_DEVICE_CAPS | V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING | V4L2_CAP_META_CAPTURE;
      return 0;
    }
    case VIDIOC_ENUM_FMT:
    case VIDIOC_ENUM_FRAMESIZES:
    case VIDIOC_ENUM_FRAMEINTERVALS: return enumerate(file, request, argument);
    case VIDIOC_S_FMT: return set_format(file, *static_cast<v4l2_format*>(argument));
    case VIDIOC_S_PARM: {
      auto& parameters = *static_cast<v4l2_streamparm*>(argument);
      if (!is_capture(parameters.type)) {
        return -EINVAL;
      }
      parameters.parm.capture.capability = V4L2_CAP_TIMEPERFRAME;
      parameters.parm.capture.timeperframe = {1000, static_cast<std::uint32_t>(file.node->camera.rate_hz * 1000)};
      return 0;
    }
    case VIDIOC_REQBUFS: return request_buffers(file, descriptor, *static_cast<v4l2_requestbuffers*>(argument));
    case VIDIOC_QUERYBUF: return query_buffer(file, *static_cast<v4l2_buffer*>(argument));
    case VIDIOC_QBUF: return queue_buffer(file, *static_cast<v4l2_buffer*>(argument));
    case VIDIOC_DQBUF: produce(file, descriptor); return dequeue_buffer(file, *static_cast<v4l2_buffer*>(argument));
    case VIDIOC_STREAMON: return is_capture(static_cast<std::uint32_t>(*static_cast<int*>(argument))) ? stream_on(file) : -EINVAL;
    case VIDIOC_STREAMOFF: return stream_off(file);
    default: return control(file, request, argument);
  }
}

int FakeKernel::enumerate(const File& file, unsigned long request, void* argument) const {
  const std::vector<FakeFormat>& formats = file.node->camera.formats;
  if (request == VIDIOC_ENUM_FMT) {
    auto& description = *static_cast<v4l2_fmtdesc*>(argument);
    if (!is_capture(description.type) || description.index >= formats.size()) {
      return -EINVAL;
    }
    description.pixelformat = formats[description.index].fourcc;
    return 0;
  }
  const auto with = [&](std::uint32_t fourcc) {
    return std::find_if(formats.begin(), formats.end(), [&](const FakeFormat& format) { return format.fourcc == fourcc; });
  };
  if (request == VIDIOC_ENUM_FRAMESIZES) {
    auto& size = *static_cast<v4l2_frmsizeenum*>(argument);
    const auto format = with(size.pixel_format);
    if (format == formats.end() || size.index >= format->sizes.size()) {
      return -EINVAL;
    }
    size.type = V4L2_FRMSIZE_TYPE_DISCRETE;
    size.discrete = {format->sizes[size.index].first, format->sizes[size.index].second};
    return 0;
  }
  auto& interval = *static_cast<v4l2_frmivalenum*>(argument);
  if (interval.index > 0 || with(interval.pixel_format) == formats.end()) {
    return -EINVAL;
  }
  interval.type = V4L2_FRMIVAL_TYPE_DISCRETE;
  interval.discrete = {1000, static_cast<std::uint32_t>(file.node->camera.rate_hz * 1000)};
  return 0;
}

/// As drivers do: what cannot be done becomes what can be, without an error.
int FakeKernel::set_format(File& file, v4l2_format& format) {
  if (!is_capture(format.type)) {
    return -EINVAL;
  }
  if (file.node->owner >= 0) {
    return -EBUSY;
  }
  v4l2_pix_format& pix = format.fmt.pix;
  const std::vector<FakeFormat>& formats = file.node->camera.formats;
  auto chosen = std::find_if(formats.begin(), formats.end(),
                             [&](const FakeFormat& candidate) { return candidate.fourcc == pix.pixelformat; });
  if (chosen == formats.end()) {
    chosen = formats.begin();
  }
  pix.pixelformat = chosen->fourcc;
  const std::pair<std::uint32_t, std::uint32_t> size{pix.width, pix.height};
  if (std::find(chosen->sizes.begin(), chosen->sizes.end(), size) == chosen->sizes.end()) {
    std::tie(pix.width, pix.height) = chosen->sizes.front();
  }
  const std::uint32_t bytes = bytes_per_pixel(pix.pixelformat);
  pix.field = V4L2_FIELD_NONE;
  pix.bytesperline = bytes == 0 ? 0 : pix.width * bytes + chosen->padding;
  pix.sizeimage = bytes == 0 ? pix.width * pix.height * 4 + 1024 : pix.bytesperline * pix.height;
  if (pix.pixelformat == V4L2_PIX_FMT_NV12) {
    pix.sizeimage += pix.bytesperline * (pix.height / 2);
  }
  if (file.node->camera.twist_format) {
    file.node->camera.twist_format(pix);
  }
  file.format = pix;
  return 0;
}

std::size_t FakeKernel::buffer_stride(const File& file) {
  return (file.format.sizeimage + kPage - 1) / kPage * kPage;
}

int FakeKernel::request_buffers(File& file, int descriptor, v4l2_requestbuffers& request) {
  Node& node = *file.node;
  if (!is_capture(request.type) || request.memory != V4L2_MEMORY_MMAP || file.format.sizeimage == 0) {
    return -EINVAL;
  }
  if ((node.owner >= 0 && node.owner != descriptor) || file.streaming) {
    return -EBUSY;
  }
  request.count = request.count == 0 ? 0 : std::clamp(request.count, node.camera.least_buffers, node.camera.most_buffers);
  file.buffers.assign(request.count, {});
  file.queued.clear();
  file.done.clear();
  node.owner = request.count > 0 ? descriptor : -1;
  return ::ftruncate(descriptor, static_cast<off_t>(buffer_stride(file) * request.count)) == 0 ? 0 : -errno;
}

int FakeKernel::query_buffer(const File& file, v4l2_buffer& buffer) {
  if (!is_capture(buffer.type) || buffer.index >= file.buffers.size()) {
    return -EINVAL;
  }
  buffer.length = file.format.sizeimage;
  buffer.m.offset = static_cast<std::uint32_t>(buffer.index * buffer_stride(file));
  return 0;
}

int FakeKernel::queue_buffer(File& file, v4l2_buffer& buffer) {
  if (!is_capture(buffer.type) || buffer.memory != V4L2_MEMORY_MMAP || buffer.index >= file.buffers.size()) {
    violation("QBUF of a buffer that there is not");
    return -EINVAL;
  }
  const bool is_done = std::find(file.done.begin(), file.done.end(), buffer.index) != file.done.end();
  if (file.buffers[buffer.index].queued || is_done) {
    violation("QBUF of a buffer that the driver has");
    return -EINVAL;
  }
  file.buffers[buffer.index].queued = true;
  file.queued.push_back(buffer.index);
  return 0;
}

int FakeKernel::dequeue_buffer(File& file, v4l2_buffer& buffer) {
  if (!is_capture(buffer.type) || buffer.memory != V4L2_MEMORY_MMAP || !file.streaming) {
    violation("DQBUF without streaming");
    return -EINVAL;
  }
  if (file.broken != 0) {
    return -file.broken;
  }
  if (file.done.empty()) {
    return -EAGAIN;
  }
  buffer = file.buffers[file.done.front()].done;
  file.done.pop_front();
  return 0;
}

int FakeKernel::stream_on(File& file) {
  if (file.buffers.empty()) {
    violation("STREAMON without buffers");
    return -EINVAL;
  }
  file.streaming = true;
  file.sequence = file.node->first_sequence;
  const TimeNs period = period_ns(file);
  const TimeNs since_ns = clock_.now_ns() - file.node->camera.phase_ns;
  file.next_image_ns = (since_ns / period + 1) * period + file.node->camera.phase_ns;
  return 0;
}

int FakeKernel::stream_off(File& file) {
  file.streaming = false;
  file.broken = 0;
  file.queued.clear();
  file.done.clear();
  for (Buffer& buffer : file.buffers) {
    buffer.queued = false;
  }
  return 0;
}

int FakeKernel::map(int descriptor, std::size_t length, std::uint32_t offset, void** address) {
  const auto file = files_.find(descriptor);
  if (file == files_.end() || offset % kPage != 0 || offset + length > buffer_stride(file->second) * file->second.buffers.size()) {
    violation("mmap of what there is not");
    return -EINVAL;
  }
  void* mapped = ::mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, static_cast<off_t>(offset));
  if (mapped == MAP_FAILED) {
    return -errno;
  }
  mappings_[mapped] = {length, descriptor};
  *address = mapped;
  return 0;
}

int FakeKernel::unmap(void* address, std::size_t length) {
  const auto mapping = mappings_.find(address);
  if (mapping == mappings_.end() || mapping->second.length != length) {
    violation("munmap of what was not mapped");
    return -EINVAL;
  }
  mappings_.erase(mapping);
  return ::munmap(address, length) == 0 ? 0 : -errno;
}

TimeNs FakeKernel::arrival_of_next(File& file) const {
  const FakeCamera& camera = file.node->camera;
  const FakeImage image = camera.fate ? camera.fate(file.sequence) : FakeImage{};
  return file.next_image_ns + camera.delay_ns + image.delay_ns;
}

/// Fills buffers with the images that have come until now. Without a buffer an image is lost, and counted.
void FakeKernel::produce(File& file, int descriptor) {
  if (!file.streaming || !is_alive(file) || file.broken != 0) {
    return;
  }
  const FakeCamera& camera = file.node->camera;
  for (TimeNs arrival_ns = arrival_of_next(file); arrival_ns <= clock_.now_ns(); arrival_ns = arrival_of_next(file)) {
    const FakeImage fate = camera.fate ? camera.fate(file.sequence) : FakeImage{};
    const TimeNs taken_ns = file.next_image_ns;
    const std::uint64_t sequence = file.sequence++;
    file.next_image_ns += period_ns(file);
    if (file.queued.empty() || fate.dropped || arrival_ns < file.node->silent_until_ns) {
      continue;
    }
    const std::uint32_t index = file.queued.front();
    file.queued.pop_front();
    file.buffers[index].queued = false;
    file.image.assign(file.format.sizeimage, 0);
    if (camera.paint) {
      camera.paint(sequence, file.format, file.image);
    }
    v4l2_buffer& done = file.buffers[index].done;
    done = {};
    done.index = index;
    done.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    done.memory = V4L2_MEMORY_MMAP;
    done.bytesused = static_cast<std::uint32_t>(static_cast<double>(file.image.size()) * fate.filled);
    done.flags = camera.stamp_flags | (fate.damaged ? V4L2_BUF_FLAG_ERROR : 0U);
    const TimeNs stamp_us = (taken_ns + camera.clock_offset_ns + fate.stamp_shift_ns) / kNsPerUs;
    done.timestamp.tv_sec = stamp_us / 1'000'000;
    done.timestamp.tv_usec = stamp_us % 1'000'000;
    done.sequence = static_cast<std::uint32_t>(sequence);
    const auto offset = static_cast<off_t>(index * buffer_stride(file));
    if (::pwrite(descriptor, file.image.data(), done.bytesused, offset) != static_cast<ssize_t>(done.bytesused)) {
      violation("the test's own image does not fit");
    }
    file.done.push_back(index);
  }
}

short FakeKernel::events_of(File& file, int descriptor) {
  if (!is_alive(file)) {
    return POLLERR | POLLHUP;
  }
  produce(file, descriptor);
  if (file.broken != 0 || !file.streaming) {
    return POLLERR;
  }
  return file.done.empty() ? short{0} : short{POLLIN};
}

int FakeKernel::poll(std::span<pollfd> descriptors, TimeNs timeout_ns) {
  const TimeNs deadline_ns = clock_.now_ns() + std::max<TimeNs>(timeout_ns, 0);
  while (true) {
    int ready = 0;
    TimeNs next_ns = deadline_ns;
    for (pollfd& polled : descriptors) {
      const auto file = files_.find(polled.fd);
      if (file == files_.end()) {
        violation("poll of a descriptor that is not open");
        return -EBADF;
      }
      polled.revents = events_of(file->second, polled.fd);
      ready += polled.revents != 0 ? 1 : 0;
      if (polled.revents == 0) {
        next_ns = std::min(next_ns, arrival_of_next(file->second));
      }
    }
    if (ready > 0 || clock_.now_ns() >= deadline_ns) {
      return ready;
    }
    clock_.sleep_until(next_ns);
  }
}

}  // namespace posed::test
