#include "slam/map_messages.h"

#include <cstdint>

namespace posed {

namespace {

constexpr std::size_t kDescriptorBytes = sizeof(Descriptor);

using RowMajor3d = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
using RowMajor6d = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

transform_t to_message(const Se3& T) {
  transform_t message;
  Eigen::Map<Eigen::Vector3d>(message.position) = T.translation();
  Eigen::Map<Eigen::Vector4d>(message.orientation) = T.rotation().coeffs();  // Eigen stores x, y, z, w
  return message;
}

Se3 from_message(const transform_t& message) {
  const Eigen::Map<const Eigen::Vector4d> xyzw(message.orientation);
  return Se3::from_unit(Eigen::Quaterniond(xyzw), Eigen::Map<const Eigen::Vector3d>(message.position));
}

void put(const Descriptor& descriptor, std::uint8_t* bytes) {
  for (std::size_t i = 0; i < kDescriptorBytes; ++i) {
    bytes[i] = static_cast<std::uint8_t>(descriptor[i / 8] >> (8 * (i % 8)));
  }
}

Descriptor get_descriptor(const std::uint8_t* bytes) {
  Descriptor descriptor{};
  for (std::size_t i = 0; i < kDescriptorBytes; ++i) {
    descriptor[i / 8] |= std::uint64_t{bytes[i]} << (8 * (i % 8));
  }
  return descriptor;
}

std::uint64_t get_count(std::span<const std::uint8_t> bytes) {
  return std::uint64_t{bytes[0]} << 24 | std::uint64_t{bytes[1]} << 16 | std::uint64_t{bytes[2]} << 8 | bytes[3];
}

}  // namespace

map_header_t to_message(const MapHeader& header, const Map& map) {
  map_header_t message;
  message.utime = header.saved_utc_ns / kNsPerUs;
  const CameraIntrinsics& k = header.camera;
  message.width = k.width;
  message.height = k.height;
  message.fx = k.fx;
  message.fy = k.fy;
  message.cx = k.cx;
  message.cy = k.cy;
  Eigen::Map<Eigen::Matrix<double, 5, 1>>(message.distortion) << k.k1, k.k2, k.p1, k.p2, k.k3;
  message.depth_units_per_metre = k.depth_units_per_metre;
  message.baseline_fx = k.baseline_fx;
  message.pyramid_levels = header.pyramid_levels;
  message.pyramid_scale = header.pyramid_scale;
  message.active_map = static_cast<std::int32_t>(header.active_map);
  message.highest_map = static_cast<std::int32_t>(header.highest_map);
  message.next_landmark = static_cast<std::int64_t>(map.next_landmark());
  message.landmarks = 0;
  for (const LandmarkId id : map.landmark_ids()) {
    message.landmarks += map.find_landmark(id)->observations.empty() ? 0 : 1;
  }
  message.keyframes = static_cast<std::int64_t>(map.keyframes().size());
  message.loops = 0;
  for (const auto& [id, keyframe] : map.keyframes()) {
    message.loops += static_cast<std::int64_t>(keyframe.loops.size());
  }
  return message;
}

MapHeader from_message(const map_header_t& message) {
  MapHeader header;
  header.saved_utc_ns = message.utime * kNsPerUs;
  CameraIntrinsics& k = header.camera;
  k.width = message.width;
  k.height = message.height;
  k.fx = message.fx;
  k.fy = message.fy;
  k.cx = message.cx;
  k.cy = message.cy;
  k.k1 = message.distortion[0];
  k.k2 = message.distortion[1];
  k.p1 = message.distortion[2];
  k.p2 = message.distortion[3];
  k.k3 = message.distortion[4];
  k.depth_units_per_metre = message.depth_units_per_metre;
  k.baseline_fx = message.baseline_fx;
  header.pyramid_levels = message.pyramid_levels;
  header.pyramid_scale = message.pyramid_scale;
  header.active_map = static_cast<std::uint32_t>(message.active_map);
  header.highest_map = static_cast<std::uint32_t>(message.highest_map);
  return header;
}

map_landmark_t to_message(LandmarkId id, const Landmark& landmark) {
  map_landmark_t message;
  message.id = static_cast<std::int64_t>(id);
  Eigen::Map<Eigen::Vector3d>(message.p_map) = landmark.p_map;
  Eigen::Map<RowMajor3d>(message.information) = landmark.information;
  Eigen::Map<Eigen::Vector3d>(message.mean_view_map) = landmark.mean_view_map;
  message.max_distance_m = landmark.max_distance_m;
  message.min_distance_m = landmark.min_distance_m;
  put(landmark.descriptor, message.descriptor);
  message.predicted = static_cast<std::int32_t>(landmark.predicted);
  message.found = static_cast<std::int32_t>(landmark.found);
  return message;
}

Landmark from_message(const map_landmark_t& message) {
  Landmark landmark;
  landmark.p_map = Eigen::Map<const Eigen::Vector3d>(message.p_map);
  landmark.information = Eigen::Map<const RowMajor3d>(message.information);
  landmark.mean_view_map = Eigen::Map<const Eigen::Vector3d>(message.mean_view_map);
  landmark.max_distance_m = message.max_distance_m;
  landmark.min_distance_m = message.min_distance_m;
  landmark.descriptor = get_descriptor(message.descriptor);
  landmark.predicted = static_cast<std::uint32_t>(message.predicted);
  landmark.found = static_cast<std::uint32_t>(message.found);
  return landmark;
}

void fill_message(map_keyframe_t& message, KeyframeId id, const Keyframe& keyframe) {
  const std::size_t n = keyframe.features.keypoints.size();
  message.keypoints = static_cast<std::int32_t>(n);
  message.descriptor_bytes = static_cast<std::int32_t>(n * kDescriptorBytes);
  message.id = static_cast<std::int64_t>(id);
  message.map_id = static_cast<std::int32_t>(keyframe.map_id);
  message.sequence = static_cast<std::int64_t>(keyframe.sequence);
  message.capture_mono_ns = keyframe.capture_ns;
  message.T_map_camera = to_message(keyframe.T_map_camera);
  Eigen::Map<RowMajor6d>(message.covariance) = keyframe.covariance;
  message.parent = static_cast<std::int64_t>(keyframe.parent);
  message.x.resize(n);
  message.y.resize(n);
  message.angle_rad.resize(n);
  message.level.resize(n);
  message.response.resize(n);
  message.descriptors.resize(n * kDescriptorBytes);
  for (std::size_t i = 0; i < n; ++i) {
    const Keypoint& k = keyframe.features.keypoints[i];
    message.x[i] = k.x;
    message.y[i] = k.y;
    message.angle_rad[i] = k.angle_rad;
    message.level[i] = k.level;
    message.response[i] = k.response;
    put(keyframe.features.descriptors[i], message.descriptors.data() + i * kDescriptorBytes);
  }
  message.depth_m = keyframe.depth_m;
  message.landmarks.assign(keyframe.landmarks.begin(), keyframe.landmarks.end());
}

Keyframe from_message(const map_keyframe_t& message, const PinholeCamera& camera) {
  Keyframe keyframe;
  keyframe.map_id = static_cast<std::uint32_t>(message.map_id);
  keyframe.sequence = static_cast<std::uint64_t>(message.sequence);
  keyframe.capture_ns = message.capture_mono_ns;
  keyframe.T_map_camera = from_message(message.T_map_camera);
  keyframe.covariance = Eigen::Map<const RowMajor6d>(message.covariance);
  keyframe.parent = static_cast<KeyframeId>(message.parent);
  const auto n = static_cast<std::size_t>(message.keypoints);
  keyframe.features.reserve(n);
  keyframe.ideal_pixels.reserve(n);
  for (std::size_t i = 0; i < n; ++i) {
    keyframe.features.keypoints.push_back(
        {message.x[i], message.y[i], message.angle_rad[i], message.level[i], message.response[i]});
    keyframe.features.descriptors.push_back(get_descriptor(message.descriptors.data() + i * kDescriptorBytes));
    keyframe.ideal_pixels.emplace_back(camera.undistort({message.x[i], message.y[i]}).cast<float>());
  }
  keyframe.depth_m = message.depth_m;
  keyframe.landmarks.assign(message.landmarks.begin(), message.landmarks.end());
  return keyframe;
}

bool is_keyframe_sized(std::span<const std::uint8_t> payload) {
  static const auto kFixedBytes = static_cast<std::uint64_t>(map_keyframe_t{}.getEncodedSize());
  constexpr std::uint64_t kBytesPerKeypoint = 3 * sizeof(float) + 2 + sizeof(float) + sizeof(std::int64_t);
  constexpr std::size_t kFingerprintBytes = 8;
  if (payload.size() < kFixedBytes) {
    return false;
  }
  const std::uint64_t keypoints = get_count(payload.subspan(kFingerprintBytes));
  const std::uint64_t descriptor_bytes = get_count(payload.subspan(kFingerprintBytes + 4));
  return descriptor_bytes == keypoints * kDescriptorBytes &&
         payload.size() == kFixedBytes + keypoints * kBytesPerKeypoint + descriptor_bytes;
}

map_loop_t to_message(KeyframeId keyframe, const LoopConstraint& loop) {
  map_loop_t message;
  message.keyframe = static_cast<std::int64_t>(keyframe);
  message.other = static_cast<std::int64_t>(loop.other);
  message.T_keyframe_other = to_message(loop.T_this_other);
  Eigen::Map<RowMajor6d>(message.information) = loop.information;
  return message;
}

LoopConstraint from_message(const map_loop_t& message) {
  LoopConstraint loop;
  loop.other = static_cast<KeyframeId>(message.other);
  loop.T_this_other = from_message(message.T_keyframe_other);
  loop.information = Eigen::Map<const RowMajor6d>(message.information);
  return loop;
}

}  // namespace posed
