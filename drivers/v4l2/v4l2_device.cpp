#include "drivers/v4l2/v4l2_device.h"

#include <cerrno>
#include <system_error>

#include <fmt/format.h>

namespace posed {

namespace {

ErrorCode code_of(int error) {
  switch (error) {
    case ENOENT:
    case ENODEV:
    case ENXIO: return ErrorCode::NotFound;
    case EBUSY: return ErrorCode::Unavailable;
    default: return ErrorCode::Io;
  }
}

/// What helps against it, where that is known.
std::string_view advice_on(int error) {
  switch (error) {
    case EBUSY: return " (another program uses it)";
    case EACCES:
    case EPERM: return " (is the user in the node's group, which is mostly `video`?)";
    case ENOSPC: return " (not enough bandwidth on its USB bus: try another port, a smaller image, a lower rate or mjpeg)";
    default: return "";
  }
}

}  // namespace

Status V4l2Device::open() {
  close();
  const int opened = system_.open(path_.c_str());
  if (opened < 0) {
    return failure("open", opened);
  }
  descriptor_ = opened;
  return {};
}

void V4l2Device::close() noexcept {
  if (descriptor_ >= 0) {
    system_.close(descriptor_);
    descriptor_ = -1;
  }
}

tl::unexpected<Error> V4l2Device::failure(std::string_view action, int negative_errno) const {
  const int error = -negative_errno;
  return make_error(code_of(error), fmt::format("{}: {}: {}{}", path_, action,
                                                std::error_code(error, std::generic_category()).message(), advice_on(error)));
}

tl::unexpected<Error> V4l2Device::unsupported(std::string_view message) const {
  return make_error(ErrorCode::Unsupported, fmt::format("{}: {}", path_, message));
}

Result<v4l2_capability> V4l2Device::capability() const {
  v4l2_capability capability{};
  const int done = ioctl(VIDIOC_QUERYCAP, &capability);
  if (done == -ENOTTY || done == -EINVAL) {
    return unsupported("not a V4L2 node");
  }
  if (done < 0) {
    return failure("QUERYCAP", done);
  }
  return capability;
}

std::uint32_t capabilities_of(const v4l2_capability& capability) {
  return (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps : capability.capabilities;
}

}  // namespace posed
