#include "drivers/v4l2/depth_node.h"

#include <bit>

#include "drivers/pixel_conversion.h"

namespace posed {

static_assert(std::endian::native == std::endian::little, "Z16 and Y16 are little-endian, and are read as they lie");

namespace {

V4l2Request request_for(const CameraIntrinsics& images, double rate_hz) {
  return {.formats = v4l2_depth_formats(), .width = images.width, .height = images.height, .rate_hz = rate_hz};
}

}  // namespace

DepthNode::DepthNode(V4l2System& system, const Clock& clock, const DepthNodeConfig& config, const CameraIntrinsics& color,
                     double rate_hz)
    : stream_(system, clock, config.node, request_for(config.calibration.empty() ? color : config.intrinsics, rate_hz)),
      units_per_metre_(color.depth_units_per_metre) {
  if (!config.calibration.empty()) {
    registration_.emplace(config.intrinsics, color, config.T_camera_depth);
  }
}

void DepthNode::write_depth(const V4l2Image& image, ImageView<float> depth_m) const {
  const V4l2Layout& layout = stream_.layout();
  // Buffers are mapped at pages and their rows have even lengths, so each pixel is aligned.
  const ImageView<const std::uint16_t> raw{reinterpret_cast<const std::uint16_t*>(image.bytes.data()), layout.width, layout.height,
                                           static_cast<std::ptrdiff_t>(layout.bytes_per_line / 2), 1};
  if (registration_) {
    registration_->apply(raw, depth_m);
  } else {
    depth_from_raw(raw, units_per_metre_, depth_m);
  }
}

}  // namespace posed
