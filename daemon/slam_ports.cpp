#include "daemon/slam_ports.h"

#include "slam/local_mapper.h"
#include "slam/tracker.h"

namespace posed {

namespace {

class SlamTracker final : public FrameTracker {
 public:
  explicit SlamTracker(const Config& config)
      // T_map_start places base at start; the tracker thinks in the camera's frame.
      : tracker_(config.tracker, config.mapper, config.intrinsics, config.camera.T_map_start * config.camera.T_base_camera) {}

  PoseEstimate track(const RgbdFrame& frame, const MapSnapshot& map, KeyframeRecord* candidate) override {
    return tracker_.track(frame, map, candidate);
  }

 private:
  Tracker tracker_;
};

class SlamMapper final : public KeyframeMapper {
 public:
  explicit SlamMapper(const Config& config) : mapper_(config.tracker, config.mapper, config.intrinsics) {}

  void insert(const KeyframeRecord& record) override { mapper_.insert(record); }
  void write_snapshot(MapSnapshot& snapshot) const override { mapper_.write_snapshot(snapshot); }
  std::optional<Se3> keyframe_pose(KeyframeId id) const override { return mapper_.keyframe_pose(id); }
  std::size_t keyframe_count() const override { return mapper_.keyframe_count(); }
  std::size_t landmark_count() const override { return mapper_.landmark_count(); }
  Status save(const std::string& path) override { return cannot_keep_maps(path); }
  Status load(const std::string& path) override { return cannot_keep_maps(path); }

 private:
  static Status cannot_keep_maps(const std::string& path) {
    return make_error(ErrorCode::Unavailable, path + ": this mapper neither saves nor loads maps");
  }

  LocalMapper mapper_;
};

}  // namespace

std::unique_ptr<FrameTracker> make_frame_tracker(const Config& config) {
  return std::make_unique<SlamTracker>(config);
}
std::unique_ptr<KeyframeMapper> make_keyframe_mapper(const Config& config) {
  return std::make_unique<SlamMapper>(config);
}

}  // namespace posed
