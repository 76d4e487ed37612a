#include "tests/support/slam_rig.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>

#include "config/config_loader.h"
#include "drivers/synthetic_camera.h"

namespace posed {

namespace {

[[noreturn]] void fail(const std::string& message) {
  std::fprintf(stderr, "%s\n", message.c_str());
  std::exit(EXIT_FAILURE);
}

}  // namespace

Config rig_config(SyntheticWorldKind world, std::int64_t seed) {
  Result<Config> config = default_config();
  if (!config) {
    fail(config.error().message);
  }
  config->source.synthetic.world = world;
  config->source.synthetic.people = 0;
  config->source.synthetic.seed = seed;
  return *config;
}

void cover_camera(RgbdFrame& frame) {
  for (int y = 0; y < frame.gray.height; ++y) {
    std::fill_n(frame.gray.row(y), frame.gray.width, std::uint8_t{0});
  }
  take_depth_away(frame);
}

void take_depth_away(RgbdFrame& frame) {
  for (int y = 0; y < frame.depth_m.height; ++y) {
    std::fill_n(frame.depth_m.row(y), frame.depth_m.width, 0.0F);
  }
}

SlamRig::SlamRig(const Config& config)
    : config_(config),
      world_(config.source.synthetic),
      renderer_(world_, config.intrinsics),
      sensor_(static_cast<std::uint32_t>(config.source.synthetic.seed)),
      pool_(config.intrinsics.width, config.intrinsics.height, 1),
      colour_(static_cast<std::size_t>(config.intrinsics.width * config.intrinsics.height)),
      depth_m_(colour_.size()),
      person_mask_(colour_.size()) {
  restart();
}

PoseEstimate SlamRig::track(std::uint64_t index, const Spoil& spoil, Mapping mapping) {
  FrameWriter frame = *pool_.acquire();
  render(index, *frame);
  if (spoil) {
    spoil(*frame);
  }
  const PoseEstimate estimate =
      tracker_->track(*frame, snapshot_, detections_ ? &*detections_ : nullptr, mapping == Mapping::Never ? nullptr : &record_);
  if (detect_every_ > 0 && frame->sequence % static_cast<std::uint64_t>(detect_every_) == 0) {
    detect_people(*frame);
  }
  if (estimate.keyframe) {
    T_world_keyframe_[record_.id] = true_pose(index);
  }
  if (estimate.keyframe || estimate.asks_where) {
    mapper_->insert(record_);
    while (mapper_->improve({})) {
    }
    mapper_->write_snapshot(snapshot_);
  }
  return estimate;
}

void SlamRig::render(std::uint64_t index, RgbdFrame& frame) {
  const CameraIntrinsics& camera = config_.intrinsics;
  const double t_s = static_cast<double>(sequence_) / config_.source.synthetic.rate_hz;
  const ImageView<PackedBgr> colour{colour_.data(), camera.width, camera.height, camera.width, 1};
  const ImageView<float> depth_m{depth_m_.data(), camera.width, camera.height, camera.width, 1};
  renderer_.render(t_s, true_pose(index), colour, depth_m, {person_mask_.data(), camera.width, camera.height, camera.width, 1});
  sensor_.measure_depth(sequence_, depth_m, frame.depth_m);
  sensor_.measure_colour(sequence_, t_s, colour, frame.bgr, frame.gray);
  frame.sequence = sequence_++;
  frame.capture_ns = from_seconds(t_s);
  frame.stamp_utc_ns = SyntheticCamera::kEpochUtc_ns + frame.capture_ns;
}

ImageView<const std::uint8_t> SlamRig::person_mask() const {
  const CameraIntrinsics& camera = config_.intrinsics;
  return {person_mask_.data(), camera.width, camera.height, camera.width, 1};
}

void SlamRig::detect_people(const RgbdFrame& frame) {
  const ImageView<const std::uint8_t> mask = person_mask();
  BoundingBox box{static_cast<float>(mask.width), static_cast<float>(mask.height), -1, -1};
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      if (mask.row(y)[x] != 0) {
        box.x_min = std::min(box.x_min, static_cast<float>(x) - 0.5F);
        box.y_min = std::min(box.y_min, static_cast<float>(y) - 0.5F);
        box.x_max = std::max(box.x_max, static_cast<float>(x) + 0.5F);
        box.y_max = std::max(box.y_max, static_cast<float>(y) + 0.5F);
      }
    }
  }
  Detections found;
  found.sequence = frame.sequence;
  found.capture_ns = frame.capture_ns;
  found.stamp_utc_ns = frame.stamp_utc_ns;
  found.image_width = mask.width;
  found.image_height = mask.height;
  if (box.area() > 0) {
    const Detection person{box, 0.9F};
    found.assign({&person, 1});
  }
  detections_ = found;
}

SlamRig::SavedMap SlamRig::save(const std::string& file) const {
  if (const Status saved = mapper_->save(file); !saved) {
    fail(saved.error().message);
  }
  return {file, T_world_keyframe_};
}

void SlamRig::restart() {
  tracker_.emplace(config_.tracker, config_.mapper, config_.dynamic, MapMode::Mapping, config_.intrinsics, Se3());
  mapper_.emplace(config_.tracker, config_.mapper, MapMode::Mapping, config_.intrinsics);
  snapshot_ = MapSnapshot();
  detections_.reset();
  T_world_keyframe_.clear();
}

void SlamRig::restart(const SavedMap& saved) {
  restart();
  if (const Status loaded = mapper_->load(saved.file); !loaded) {
    fail(loaded.error().message);
  }
  mapper_->write_snapshot(snapshot_);
  T_world_keyframe_ = saved.T_world_keyframe;
}

Se3 SlamRig::true_pose_on_path(std::uint64_t index) const {
  return world_.camera_pose(static_cast<double>(index) / config_.source.synthetic.rate_hz);
}

Se3 SlamRig::true_pose(std::uint64_t index) const {
  return true_pose_on_path(index) * T_path_camera_;
}

double SlamRig::error_m(std::uint64_t index, const PoseEstimate& estimate) const {
  return distance_between_m(estimate.T_map_camera(), true_pose_in_map(index));
}

Se3 SlamRig::place_in(const SavedMap& saved, const Se3& T_world_camera) const {
  double least = std::numeric_limits<double>::infinity();
  Se3 T_map_camera;
  for (const auto& [id, T_world_keyframe] : saved.T_world_keyframe) {
    const Se3 T_keyframe_camera = T_world_keyframe.inverse() * T_world_camera;
    const std::optional<Se3> T_map_keyframe = mapper_->keyframe_pose(id);
    if (const double distance = T_keyframe_camera.log().norm(); T_map_keyframe && distance < least) {
      least = distance;
      T_map_camera = *T_map_keyframe * T_keyframe_camera;
    }
  }
  return T_map_camera;
}

std::optional<Se3> SlamRig::final_pose(const PoseEstimate& estimate) const {
  const std::optional<Se3> keyframe = estimate.has_pose() ? mapper_->keyframe_pose(estimate.reference_keyframe) : std::nullopt;
  return keyframe ? std::optional(*keyframe * estimate.T_reference_camera) : std::nullopt;
}

std::uint64_t SlamRig::frames_a_round() const {
  return static_cast<std::uint64_t>(std::lround(world_.trajectory().period_s() * config_.source.synthetic.rate_hz));
}

double angle_between_rad(const Se3& T_a, const Se3& T_b) {
  return log_so3(T_a.rotation().conjugate() * T_b.rotation()).norm();
}

double distance_between_m(const Se3& T_a, const Se3& T_b) {
  return (T_a.translation() - T_b.translation()).norm();
}

}  // namespace posed
