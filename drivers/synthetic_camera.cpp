#include "drivers/synthetic_camera.h"

#include <cmath>
#include <string_view>

#include <fmt/format.h>

namespace posed {

namespace {

constexpr int kMaxSide = 4096;

Status check(const SyntheticConfig& config, const CameraIntrinsics& camera) {
  if (config.people < 0 || config.people > SyntheticWorld::kMaxPeople) {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("source.synthetic.people = {}: 0 to {} are possible", config.people, SyntheticWorld::kMaxPeople));
  }
  if (config.people > 0 && config.world != SyntheticWorldKind::Room) {
    return make_error(
        ErrorCode::InvalidArgument,
        fmt::format("source.synthetic.people = {}: only source.synthetic.world = \"room\" has people, \"{}\" has none; "
                    "set people to 0",
                    config.people, world_name(config.world)));
  }
  if (!(config.rate_hz > 0.0) || !std::isfinite(config.rate_hz)) {
    return make_error(ErrorCode::InvalidArgument, fmt::format("source.synthetic.rate_hz = {}: must be above 0", config.rate_hz));
  }
  if (!(config.duration_s >= 0.0) || !std::isfinite(config.duration_s)) {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("source.synthetic.duration_s = {}: must be 0 (endless) or more", config.duration_s));
  }
  if (camera.width < 16 || camera.height < 16 || camera.width > kMaxSide || camera.height > kMaxSide || !(camera.fx > 0.0) ||
      !(camera.fy > 0.0)) {
    return make_error(
        ErrorCode::InvalidArgument,
        fmt::format("the synthetic source cannot render {}x{} pixels with fx = {}, fy = {}: sides of 16 to {} and focal "
                    "lengths above 0 are possible",
                    camera.width, camera.height, camera.fx, camera.fy, kMaxSide));
  }
  return {};
}

template <typename T>
Status check_view(std::string_view name, const ImageView<T>& view, const CameraIntrinsics& camera, int channels) {
  if (view.empty() || view.width != camera.width || view.height != camera.height || view.channels != channels) {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("the view for {} has {}x{}x{} elements, the synthetic camera has {}x{}x{}", name, view.width,
                                  view.height, view.channels, camera.width, camera.height, channels));
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<SyntheticCamera>> SyntheticCamera::create(const SyntheticConfig& config, const CameraIntrinsics& camera) {
  if (Status status = check(config, camera); !status) {
    return tl::unexpected(status.error());
  }
  return std::unique_ptr<SyntheticCamera>(new SyntheticCamera(config, camera));
}

SyntheticCamera::SyntheticCamera(const SyntheticConfig& config, const CameraIntrinsics& camera)
    : config_(config),
      camera_(camera),
      total_frames_(static_cast<std::uint64_t>(std::ceil(config.duration_s * config.rate_hz - 1e-9))),
      world_(config),
      renderer_(world_, camera),
      sensor_(static_cast<std::uint32_t>(config.seed)),
      colour_(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height)),
      depth_m_(colour_.size()) {}

TimeNs SyntheticCamera::due_ns(std::uint64_t index) const {
  return static_cast<TimeNs>(std::llround(static_cast<double>(index) * 1e9 / config_.rate_hz));
}

Status SyntheticCamera::render(std::uint64_t index, RgbdFrame& frame, ImageView<std::uint8_t> person_mask) {
  Status status =
      check_view("colour", frame.bgr, camera_, 3)
          .and_then([&] { return check_view("grey", frame.gray, camera_, 1); })
          .and_then([&] { return check_view("depth", frame.depth_m, camera_, 1); })
          .and_then([&] { return person_mask.empty() ? Status{} : check_view("the person mask", person_mask, camera_, 1); });
  if (!status) {
    return status;
  }
  const double t_s = to_seconds(due_ns(index));
  const Se3 T_world_camera = world_.camera_pose(t_s);
  const ImageView<PackedBgr> colour{colour_.data(), camera_.width, camera_.height, camera_.width, 1};
  if (config_.sensor_noise) {
    const ImageView<float> depth_m{depth_m_.data(), camera_.width, camera_.height, camera_.width, 1};
    renderer_.render(t_s, T_world_camera, colour, depth_m, person_mask);
    sensor_.measure_depth(index, depth_m, frame.depth_m);
    sensor_.measure_colour(index, t_s, colour, frame.bgr, frame.gray);
  } else {
    renderer_.render(t_s, T_world_camera, colour, frame.depth_m, person_mask);
    SyntheticSensor::copy_colour(colour, frame.bgr, frame.gray);
  }
  frame.sequence = index;
  frame.stamp_utc_ns = kEpochUtc_ns + due_ns(index);
  frame.T_world_camera_truth = T_world_camera;
  return {};
}

}  // namespace posed
