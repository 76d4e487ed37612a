#include "slam/map_io.h"

#include <array>
#include <limits>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "core/pinhole_camera.h"
#include "slam/map_check.h"
#include "slam/map_file.h"
#include "slam/map_messages.h"

namespace posed {

namespace {

Status check_own(const std::string& path, const std::string& broken) {
  if (broken.empty()) {
    return {};
  }
  return make_error(
      ErrorCode::InvalidArgument,
      fmt::format("{}: not saved, for the map could not be loaded again, which is a fault in posed: {}", path, broken));
}

/// The first value in which two cameras or pyramids differ, in words, or nothing.
std::string difference(const MapHeader& found, const MapHeader& expected) {
  struct Value {
    std::string_view name;
    double found;
    double expected;
  };
  const CameraIntrinsics& a = found.camera;
  const CameraIntrinsics& b = expected.camera;
  const std::array<Value, 13> camera{{{"width", static_cast<double>(a.width), static_cast<double>(b.width)},
                                      {"height", static_cast<double>(a.height), static_cast<double>(b.height)},
                                      {"fx", a.fx, b.fx},
                                      {"fy", a.fy, b.fy},
                                      {"cx", a.cx, b.cx},
                                      {"cy", a.cy, b.cy},
                                      {"distortion k1", a.k1, b.k1},
                                      {"distortion k2", a.k2, b.k2},
                                      {"distortion p1", a.p1, b.p1},
                                      {"distortion p2", a.p2, b.p2},
                                      {"distortion k3", a.k3, b.k3},
                                      {"depth_units_per_metre", a.depth_units_per_metre, b.depth_units_per_metre},
                                      {"baseline_fx", a.baseline_fx, b.baseline_fx}}};
  for (const Value& value : camera) {
    if (value.found != value.expected) {
      return fmt::format("was made with another camera: its {} is {}, the calibration says {}", value.name, value.found,
                         value.expected);
    }
  }
  if (found.pyramid_levels != expected.pyramid_levels) {
    return fmt::format("was made with tracker.pyramid_levels = {}, configured is {}", found.pyramid_levels,
                       expected.pyramid_levels);
  }
  if (found.pyramid_scale != expected.pyramid_scale) {
    return fmt::format("was made with tracker.pyramid_scale = {}, configured is {}", found.pyramid_scale, expected.pyramid_scale);
  }
  return {};
}

/// Takes the records of one file in, each checked against those before it.
class MapLoader {
 public:
  MapLoader(MapFileReader& file, const MapHeader& expected) : file_(file), expected_(expected), camera_(expected.camera) {}

  Status load(const std::string& path);
  LoadedMap take() { return std::move(loaded_); }

 private:
  Status take_header(const std::string& path);
  Status take_record(MapRecordKind kind);
  Status take_landmark();
  Status take_keyframe();
  Status take_loop();
  Status check_whole() const;

  MapFileReader& file_;
  const MapHeader& expected_;
  PinholeCamera camera_;
  LoadedMap loaded_;
  map_header_t announced_{};
  map_keyframe_t keyframe_{};
  std::int64_t last_landmark_ = 0;
  std::int64_t last_keyframe_ = 0;
  std::int64_t last_loop_ = 0;
  std::int64_t landmarks_ = 0;
  std::int64_t keyframes_ = 0;
  std::int64_t loops_ = 0;
};

Status MapLoader::load(const std::string& path) {
  if (const Status header = take_header(path); !header) {
    return header;
  }
  MapRecordKind previous = MapRecordKind::Header;
  while (true) {
    const Result<MapRecordKind> kind = file_.next();
    if (!kind) {
      return tl::unexpected<Error>(kind.error());
    }
    if (*kind == MapRecordKind::End) {
      return check_whole();
    }
    if (*kind < previous) {
      return file_.damaged("the records are not in their order");
    }
    previous = *kind;
    if (const Status taken = take_record(*kind); !taken) {
      return taken;
    }
  }
}

Status MapLoader::take_header(const std::string& path) {
  const Result<MapRecordKind> kind = file_.next();
  if (!kind) {
    return tl::unexpected<Error>(kind.error());
  }
  if (*kind != MapRecordKind::Header || !file_.decode(announced_)) {
    return file_.damaged("it has no header");
  }
  constexpr std::int64_t kLatest = std::numeric_limits<std::int64_t>::max() / kNsPerUs;
  if (announced_.next_landmark < 1 || announced_.utime > kLatest || announced_.utime < -kLatest) {
    return file_.damaged("its numbers are not possible");
  }
  loaded_.header = from_message(announced_);
  if (const std::string broken = broken_rule(loaded_.header); !broken.empty()) {
    return file_.damaged(broken);
  }
  loaded_.map.restore_next_landmark(static_cast<LandmarkId>(announced_.next_landmark));
  if (const std::string differs = difference(loaded_.header, expected_); !differs.empty()) {
    return make_error(ErrorCode::InvalidConfig,
                      fmt::format("{}: {}. Set what the map was made with, or name another file for the map", path, differs));
  }
  return {};
}

Status MapLoader::take_record(MapRecordKind kind) {
  switch (kind) {
    case MapRecordKind::Landmark: return take_landmark();
    case MapRecordKind::Keyframe: return take_keyframe();
    case MapRecordKind::Loop: return take_loop();
    case MapRecordKind::Header:
    case MapRecordKind::End: break;
  }
  return file_.damaged("a record of an unknown kind");
}

Status MapLoader::take_landmark() {
  map_landmark_t message;
  if (!file_.decode(message)) {
    return file_.damaged("it is no landmark");
  }
  if (message.id <= last_landmark_ || message.id >= announced_.next_landmark) {
    return file_.damaged(fmt::format("landmark {}: its identifier is not possible here", message.id));
  }
  last_landmark_ = message.id;
  ++landmarks_;
  const auto id = static_cast<LandmarkId>(message.id);
  Landmark landmark = from_message(message);
  if (const std::string broken = broken_rule(id, landmark); !broken.empty()) {
    return file_.damaged(broken);
  }
  loaded_.map.restore_landmark(id, std::move(landmark));
  return {};
}

Status MapLoader::take_keyframe() {
  if (!is_keyframe_sized(file_.payload()) || !file_.decode(keyframe_)) {
    return file_.damaged("it is no keyframe");
  }
  if (keyframe_.id <= last_keyframe_) {
    return file_.damaged(fmt::format("keyframe {}: its identifier is not possible here", keyframe_.id));
  }
  last_keyframe_ = keyframe_.id;
  ++keyframes_;
  const auto id = static_cast<KeyframeId>(keyframe_.id);
  Keyframe keyframe = from_message(keyframe_, camera_);
  if (const std::string broken = broken_rule(id, keyframe, loaded_.header, loaded_.map); !broken.empty()) {
    return file_.damaged(broken);
  }
  loaded_.map.restore_keyframe(id, std::move(keyframe));
  return {};
}

Status MapLoader::take_loop() {
  map_loop_t message;
  if (!file_.decode(message)) {
    return file_.damaged("it is no loop");
  }
  if (message.keyframe < last_loop_) {
    return file_.damaged("the loops are not in the order of their keyframes");
  }
  last_loop_ = message.keyframe;
  ++loops_;
  const auto id = static_cast<KeyframeId>(message.keyframe);
  const LoopConstraint loop = from_message(message);
  if (const std::string broken = broken_rule(id, loop, loaded_.map); !broken.empty()) {
    return file_.damaged(broken);
  }
  loaded_.map.find_keyframe(id)->loops.push_back(loop);
  return {};
}

Status MapLoader::check_whole() const {
  if (landmarks_ != announced_.landmarks || keyframes_ != announced_.keyframes || loops_ != announced_.loops) {
    return file_.damaged(fmt::format("{} landmarks, {} keyframes and {} loops instead of {}, {} and {}", landmarks_, keyframes_,
                                     loops_, announced_.landmarks, announced_.keyframes, announced_.loops));
  }
  for (const LandmarkId id : loaded_.map.landmark_ids()) {
    if (loaded_.map.find_landmark(id)->observations.empty()) {
      return file_.damaged(fmt::format("landmark {}: no keyframe observes it", id));
    }
  }
  const std::string broken = broken_spanning_tree(loaded_.map);
  return broken.empty() ? Status{} : file_.damaged(broken);
}

Status write_landmarks(MapFileWriter& file, const std::string& path, const Map& map) {
  for (const LandmarkId id : map.landmark_ids()) {
    const Landmark& landmark = *map.find_landmark(id);
    if (landmark.observations.empty()) {
      continue;
    }
    if (const Status own = check_own(path, broken_rule(id, landmark)); !own) {
      return own;
    }
    if (const Status written = file.write(MapRecordKind::Landmark, to_message(id, landmark)); !written) {
      return written;
    }
  }
  return {};
}

Status write_keyframes(MapFileWriter& file, const std::string& path, const Map& map, const MapHeader& header) {
  map_keyframe_t message{};
  for (const auto& [id, keyframe] : map.keyframes()) {
    if (const Status own = check_own(path, broken_rule(id, keyframe, header, map)); !own) {
      return own;
    }
    fill_message(message, id, keyframe);
    if (const Status written = file.write(MapRecordKind::Keyframe, message); !written) {
      return written;
    }
  }
  return check_own(path, broken_spanning_tree(map));
}

Status write_loops(MapFileWriter& file, const std::string& path, const Map& map) {
  for (const auto& [id, keyframe] : map.keyframes()) {
    for (const LoopConstraint& loop : keyframe.loops) {
      if (const Status own = check_own(path, broken_rule(id, loop, map)); !own) {
        return own;
      }
      if (const Status written = file.write(MapRecordKind::Loop, to_message(id, loop)); !written) {
        return written;
      }
    }
  }
  return {};
}

}  // namespace

Status save_map(const std::string& path, const Map& map, const MapHeader& header) {
  if (const Status own = check_own(path, broken_rule(header)); !own) {
    return own;
  }
  Result<MapFileWriter> file = MapFileWriter::create(path);
  if (!file) {
    return tl::unexpected<Error>(file.error());
  }
  Status status = file->write(MapRecordKind::Header, to_message(header, map));
  status = status ? write_landmarks(*file, path, map) : status;
  status = status ? write_keyframes(*file, path, map, header) : status;
  status = status ? write_loops(*file, path, map) : status;
  return status ? file->commit() : status;
}

Result<LoadedMap> load_map(const std::string& path, const MapHeader& expected) {
  Result<MapFileReader> file = MapFileReader::open(path);
  if (!file) {
    return tl::unexpected<Error>(file.error());
  }
  MapLoader loader(*file, expected);
  if (const Status loaded = loader.load(path); !loaded) {
    return tl::unexpected<Error>(loaded.error());
  }
  return loader.take();
}

}  // namespace posed
