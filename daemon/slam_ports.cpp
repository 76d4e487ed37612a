#include "daemon/slam_ports.h"

#include "slam/mapper.h"
#include "slam/tracker.h"

namespace posed {

namespace {

class SlamTracker final : public FrameTracker {
 public:
  explicit SlamTracker(const Config& config)
      // T_map_start places base at start; the tracker thinks in the camera's frame.
      : tracker_(config.tracker, config.mapper, config.dynamic, config.map.mode, config.intrinsics,
                 config.camera.T_map_start * config.camera.T_base_camera) {}

  PoseEstimate track(const RgbdFrame& frame, const MapSnapshot& map, const Detections* newest, KeyframeRecord* candidate) override {
    return tracker_.track(frame, map, newest, candidate);
  }
  const DynamicMask* last_mask() const override { return tracker_.last_mask(); }
  const Features* last_features() const override { return &tracker_.last_features().features(); }

 private:
  Tracker tracker_;
};

class SlamMapper final : public KeyframeMapper {
 public:
  explicit SlamMapper(const Config& config) : mapper_(config.tracker, config.mapper, config.map.mode, config.intrinsics) {}

  void insert(const KeyframeRecord& record) override { mapper_.insert(record); }
  bool improve(const Interrupt& interrupt) override { return mapper_.improve(interrupt); }
  void write_snapshot(MapSnapshot& snapshot) const override { mapper_.write_snapshot(snapshot); }
  std::optional<Se3> keyframe_pose(KeyframeId id) const override { return mapper_.keyframe_pose(id); }
  std::size_t keyframe_count() const override { return mapper_.keyframe_count(); }
  std::size_t landmark_count() const override { return mapper_.landmark_count(); }
  MapperCounters counters() const override { return mapper_.counters(); }
  Status save(const std::string& path) override { return mapper_.save(path); }
  Status load(const std::string& path) override { return mapper_.load(path); }

 private:
  Mapper mapper_;
};

}  // namespace

std::unique_ptr<FrameTracker> make_frame_tracker(const Config& config) {
  return std::make_unique<SlamTracker>(config);
}
std::unique_ptr<KeyframeMapper> make_keyframe_mapper(const Config& config) {
  return std::make_unique<SlamMapper>(config);
}

}  // namespace posed
