#include "tests/bench/slam/place_views.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <numbers>
#include <string>

#include <fmt/format.h>

#include "config/config.h"
#include "drivers/image_file.h"
#include "drivers/synthetic_hash.h"
#include "drivers/synthetic_renderer.h"
#include "drivers/synthetic_sensor.h"
#include "drivers/synthetic_world.h"
#include "drivers/tum_sequence.h"
#include "slam/orb_extractor.h"

namespace posed {
namespace {

constexpr int kWidth = 320;
constexpr int kHeight = 240;
constexpr int kFeatures = 600;

CameraIntrinsics small_camera() {
  CameraIntrinsics k;
  k.width = kWidth;
  k.height = kHeight;
  k.fx = k.fy = 262.5;
  k.cx = 159.5;
  k.cy = 119.5;
  return k;
}

template <typename T>
struct Image {
  std::vector<T> pixels;
  ImageView<T> view;

  Image(int width, int height, int channels = 1)
      : pixels(static_cast<std::size_t>(width * height * channels)),
        view{pixels.data(), width, height, width * channels, channels} {}
};

void keep_those_with_depth(const Features& features, ImageView<const float> depth_m, std::vector<Descriptor>& descriptors) {
  descriptors.clear();
  for (std::size_t i = 0; i < features.keypoints.size(); ++i) {
    const Keypoint& k = features.keypoints[i];
    if (depth_m.at(static_cast<int>(std::lround(k.x)), static_cast<int>(std::lround(k.y))) > 0) {
      descriptors.push_back(features.descriptors[i]);
    }
  }
}

/// One synthetic room and a camera in it.
class Room {
 public:
  explicit Room(int seed)
      : seed_(seed), world_(config(seed)), renderer_(world_, small_camera()), sensor_(static_cast<std::uint32_t>(seed)) {}

  Se3 path(double t_s) const { return world_.camera_pose(t_s); }

  PlaceView view(const Se3& T_room_camera, std::uint64_t frame) {
    renderer_.render(0, T_room_camera, colour_.view, clean_depth_.view, {});
    sensor_.measure_depth(frame, clean_depth_.view, depth_.view);
    sensor_.measure_colour(frame, static_cast<double>(frame) * 0.1, colour_.view, bgr_.view, gray_.view);
    extractor_.extract(gray_.view, features_);
    PlaceView v{seed_, T_room_camera, {}};
    keep_those_with_depth(features_, depth_.view, v.descriptors);
    return v;
  }

 private:
  static SyntheticConfig config(int seed) {
    SyntheticConfig c;
    c.seed = seed;
    c.people = 0;
    return c;
  }
  static TrackerConfig tracker_config() {
    TrackerConfig c;
    c.features = kFeatures;
    return c;
  }

  int seed_;
  SyntheticWorld world_;
  SyntheticRenderer renderer_;
  SyntheticSensor sensor_;
  OrbExtractor extractor_{tracker_config(), kWidth, kHeight};
  Image<PackedBgr> colour_{kWidth, kHeight};
  Image<float> clean_depth_{kWidth, kHeight};
  Image<float> depth_{kWidth, kHeight};
  Image<std::uint8_t> bgr_{kWidth, kHeight, 3};
  Image<std::uint8_t> gray_{kWidth, kHeight};
  Features features_;
};

Eigen::Vector3d unit_vector(HashRng& random) {
  const double z = random.uniform(-1.0F, 1.0F);
  const double bearing_rad = random.uniform() * 2 * std::numbers::pi;
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(bearing_rad), r * std::sin(bearing_rad), z};
}

Se3 beside(const Se3& T_room_camera, HashRng& random) {
  const double angle_rad = random.uniform(5.0F, 15.0F) * std::numbers::pi / 180;
  const double distance_m = random.uniform(0.1F, 0.3F);
  const Eigen::Quaterniond R(Eigen::AngleAxisd(angle_rad, unit_vector(random)));
  return T_room_camera * Se3(R, distance_m * unit_vector(random));
}

// --- The cache: counts and plain values, as they lie in memory -------------------------------------------------------------------

template <typename T>
void write_value(std::ostream& out, const T& value) {
  out.write(reinterpret_cast<const char*>(&value), sizeof(T));
}

template <typename T>
T read_value(std::istream& in) {
  T value{};
  in.read(reinterpret_cast<char*>(&value), sizeof(T));
  return value;
}

void write_views(std::ostream& out, const std::vector<PlaceView>& views) {
  write_value(out, views.size());
  for (const PlaceView& v : views) {
    write_value(out, v.room);
    const Vector6d xi = v.T_room_camera.log();
    out.write(reinterpret_cast<const char*>(xi.data()), sizeof(double) * 6);
    write_value(out, v.descriptors.size());
    out.write(reinterpret_cast<const char*>(v.descriptors.data()),
              static_cast<std::streamsize>(v.descriptors.size() * sizeof(Descriptor)));
  }
}

std::vector<PlaceView> read_views(std::istream& in) {
  std::vector<PlaceView> views(read_value<std::size_t>(in));
  for (PlaceView& v : views) {
    v.room = read_value<std::int32_t>(in);
    Vector6d xi;
    in.read(reinterpret_cast<char*>(xi.data()), sizeof(double) * 6);
    v.T_room_camera = Se3::exp(xi);
    v.descriptors.resize(read_value<std::size_t>(in));
    in.read(reinterpret_cast<char*>(v.descriptors.data()), static_cast<std::streamsize>(v.descriptors.size() * sizeof(Descriptor)));
  }
  return views;
}

[[noreturn]] void fail(const std::string& message) {
  std::fprintf(stderr, "%s\n", message.c_str());
  std::exit(EXIT_FAILURE);
}

std::map<double, Se3> read_truth(const std::filesystem::path& file) {
  std::map<double, Se3> poses;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    double stamp_s = 0;
    Eigen::Vector3d t;
    Eigen::Quaterniond q;
    if (std::sscanf(line.c_str(), "%lf %lf %lf %lf %lf %lf %lf %lf", &stamp_s, &t.x(), &t.y(), &t.z(), &q.x(), &q.y(), &q.z(),
                    &q.w()) == 8) {
      poses.emplace(stamp_s, Se3(q, t));
    }
  }
  return poses;
}

}  // namespace

PlaceViews synthetic_place_views(int rooms, int per_room, int queries_per_room) {
  const std::filesystem::path cache =
      std::filesystem::temp_directory_path() /
      fmt::format("posed_place_views_{}_{}_{}_{}.bin", rooms, per_room, queries_per_room, kFeatures);
  PlaceViews views;
  if (std::ifstream in(cache, std::ios::binary); in) {
    views.keyframes = read_views(in);
    views.queries = read_views(in);
    if (!in) {
      fail(fmt::format("{} is damaged: remove it, it will be made anew", cache.string()));
    }
    return views;
  }
  const double step_s = SweepTrajectory::kPeriod_s / per_room;
  for (int seed = 1; seed <= rooms; ++seed) {
    Room room(seed);
    HashRng random(static_cast<std::uint32_t>(seed));
    std::uint64_t frame = 0;
    for (int i = 0; i < per_room; ++i) {
      views.keyframes.push_back(room.view(room.path(i * step_s), frame++));
    }
    for (int i = 0; i < queries_per_room; ++i) {
      const auto at = random.index(static_cast<std::uint32_t>(per_room));
      views.queries.push_back(room.view(beside(room.path(at * step_s), random), frame++));
    }
    std::fprintf(stderr, "room %d of %d rendered\n", seed, rooms);
  }
  std::ofstream out(cache, std::ios::binary);
  write_views(out, views.keyframes);
  write_views(out, views.queries);
  if (!out.flush()) {
    std::error_code ignored;
    std::filesystem::remove(cache, ignored);
    fail(fmt::format("{} cannot be written", cache.string()));
  }
  return views;
}

PlaceViews recorded_place_views(const std::filesystem::path& sequence, std::int32_t room) {
  PlaceViews views;
  ReplayConfig config;
  config.sequence = sequence.string();
  const Result<TumSequence> recording = load_tum_sequence(config);
  const std::map<double, Se3> truth = read_truth(sequence / "groundtruth.txt");
  if (!recording || truth.empty()) {
    return views;
  }
  constexpr int kRecordedWidth = 640;
  constexpr int kRecordedHeight = 480;
  ImageDecoder decoder;
  OrbExtractor extractor({}, kRecordedWidth, kRecordedHeight);
  Image<std::uint8_t> bgr(kRecordedWidth, kRecordedHeight, 3);
  Image<std::uint8_t> gray(kRecordedWidth, kRecordedHeight);
  Image<float> depth_m(kRecordedWidth, kRecordedHeight);
  Features features;
  for (std::size_t i = 0; i < recording->pairs.size(); i += 5) {
    const TumAssociation& pair = recording->pairs[i];
    if (!decoder.read_color(sequence / pair.color.image, bgr.view, gray.view) ||
        !decoder.read_depth(sequence / pair.depth.image, 5000.0, depth_m.view)) {
      continue;
    }
    extractor.extract(gray.view, features);
    const auto pose = truth.lower_bound(static_cast<double>(pair.color.stamp_ns) * 1e-9);
    if (pose == truth.end()) {
      continue;
    }
    PlaceView v{room, pose->second, {}};
    keep_those_with_depth(features, depth_m.view, v.descriptors);
    (i % 10 == 0 ? views.keyframes : views.queries).push_back(std::move(v));
  }
  return views;
}

}  // namespace posed
