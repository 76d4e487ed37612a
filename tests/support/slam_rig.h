#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "config/config.h"
#include "core/estimates.h"
#include "core/frame_pool.h"
#include "drivers/synthetic_renderer.h"
#include "drivers/synthetic_sensor.h"
#include "drivers/synthetic_world.h"
#include "slam/mapper.h"
#include "slam/tracker.h"

namespace posed {

/// The shipped defaults, for the synthetic camera of 320x240 in a world without people.
Config rig_config(SyntheticWorldKind world = SyntheticWorldKind::Room, std::int64_t seed = 1);

/// What a frame shows instead of the world as it is: for SlamRig::track.
using Spoil = std::function<void(RgbdFrame&)>;
void cover_camera(RgbdFrame& frame);     ///< black, and no depth
void take_depth_away(RgbdFrame& frame);  ///< the image stays

/// Tracker and mapper taking turns, as in lockstep, over a synthetic world. The camera follows the world's way, but any frame may
/// follow any other: a jump of the index carries it elsewhere in no time. Time and sensor noise go on from call to call, whatever
/// the index. Ends the program with a message where something fails that is not under test. Thread-bound.
class SlamRig {
 public:
  enum class Mapping {
    AtOnce,  ///< the mapper takes a keyframe in, and does all there is to do, before the next frame
    Never,   ///< the mapper is always behind: there is no room for a keyframe
  };

  explicit SlamRig(const Config& config = rig_config());

  /// The frame from where the camera is at frame `index` of its way (and at `T_path_camera` there), as `spoil` leaves it.
  PoseEstimate track(std::uint64_t index, const Spoil& spoil = {}, Mapping mapping = Mapping::AtOnce);
  PoseEstimate track(std::uint64_t index, Mapping mapping) { return track(index, {}, mapping); }

  /// From now on a detector without error looks for the one person in every `frames`-th frame, and is one frame late. 0: none, as
  /// at the start.
  void detect_people_every(int frames) { detect_every_ = frames; }

  /// Of the last frame: not 0 where it shows a person.
  ImageView<const std::uint8_t> person_mask() const;

  /// From now on the camera is held here, beside its way.
  void hold_beside(const Se3& T_path_camera) { T_path_camera_ = T_path_camera; }

  /// A map on disk, with the true pose of each of its keyframes.
  struct SavedMap {
    std::string file;
    std::map<KeyframeId, Se3> T_world_keyframe;
  };
  SavedMap save(const std::string& file) const;

  /// As if the daemon was ended and started again, without a map or with one.
  void restart();
  void restart(const SavedMap& saved);

  /// T_world_camera of frame `index`.
  Se3 true_pose(std::uint64_t index) const;
  /// The same with the first camera of the way as the map's frame: where a map without error has the camera.
  Se3 true_pose_in_map(std::uint64_t index) const { return true_pose_on_path(0).inverse() * true_pose(index); }
  /// Distance [m] between estimate and truth, in that frame.
  double error_m(std::uint64_t index, const PoseEstimate& estimate) const;

  /// Where `T_world_camera` is in the map as it was saved, drift included: relative to the nearest of its keyframes that is left.
  Se3 place_in(const SavedMap& saved, const Se3& T_world_camera) const;

  /// T_map_camera of an estimate made before, with what the map was corrected by since; nothing where it had no pose.
  std::optional<Se3> final_pose(const PoseEstimate& estimate) const;

  std::uint64_t frames_a_round() const;
  const Tracker& tracker() const { return *tracker_; }
  /// The last keyframe that was handed to the mapper.
  const KeyframeRecord& record() const { return record_; }
  Mapper& mapper() { return *mapper_; }
  const Mapper& mapper() const { return *mapper_; }
  const MapSnapshot& snapshot() const { return snapshot_; }
  const Config& config() const { return config_; }

 private:
  void render(std::uint64_t index, RgbdFrame& frame);
  void detect_people(const RgbdFrame& frame);
  Se3 true_pose_on_path(std::uint64_t index) const;

  Config config_;
  SyntheticWorld world_;
  SyntheticRenderer renderer_;
  SyntheticSensor sensor_;
  FramePool pool_;
  std::vector<PackedBgr> colour_;
  std::vector<float> depth_m_;
  std::vector<std::uint8_t> person_mask_;
  int detect_every_ = 0;
  std::optional<Detections> detections_;
  std::optional<Tracker> tracker_;
  std::optional<Mapper> mapper_;
  MapSnapshot snapshot_;
  KeyframeRecord record_;
  Se3 T_path_camera_;
  std::uint64_t sequence_ = 0;
  std::map<KeyframeId, Se3> T_world_keyframe_;
};

/// Rotation angle [rad] and distance [m] between two poses.
double angle_between_rad(const Se3& T_a, const Se3& T_b);
double distance_between_m(const Se3& T_a, const Se3& T_b);

}  // namespace posed
