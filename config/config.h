#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "config/camera_source_config.h"
#include "config/detector_config.h"
#include "config/dynamic_config.h"
#include "core/pinhole_camera.h"
#include "core/se3.h"

/// The daemon's configuration as typed values: units in the names, defaults here, ranges and descriptions in config_schema.cpp.
namespace posed {

enum class SourceKind { Synthetic, Replay, OpenNi2, V4l2, Libcamera };
enum class Pacing { Realtime, Lockstep };
enum class SyntheticMode { Sitting, Walking };
enum class SyntheticWorldKind { Room, Corridor, Office, TwinRooms };

struct ReplayConfig {
  std::string sequence;      ///< folder in the TUM RGB-D layout
  std::string associations;  ///< file of "colour-stamp path depth-stamp path" lines; empty: pair rgb.txt and depth.txt by stamps
  double max_stamp_difference_s = 0.02;
  int decode_ahead = 4;  ///< frames
  bool loop = false;     ///< begin again at the end
};

struct SyntheticConfig {
  SyntheticWorldKind world = SyntheticWorldKind::Room;
  SyntheticMode mode = SyntheticMode::Walking;
  int people = 2;
  std::int64_t seed = 1;
  double rate_hz = 30.0;
  double duration_s = 0.0;  ///< 0: endless
  bool sensor_noise = true;
};

struct SourceConfig {
  SourceKind kind = SourceKind::Synthetic;
  Pacing pacing = Pacing::Realtime;
  ReplayConfig replay;
  SyntheticConfig synthetic;
  LiveConfig live;
  OpenNi2Config openni2;
  V4l2Config v4l2;
  LibcameraConfig libcamera;
  DepthNodeConfig depth;
  std::vector<std::string> faults;  ///< put into a recording or the rendered world: drivers/fault_injection.h
};

struct CameraConfig {
  std::string calibration =
      "synthetic.toml";  ///< file; a relative name is looked for beside the configuration, then among the shipped ones
  Se3 T_base_camera;     ///< camera (optical) frame to the robot's base frame
  Se3 T_map_start;       ///< where base is in map at start, so that the map can be level
};

struct TrackerConfig {
  int features = 1000;  ///< keypoints a frame
  int pyramid_levels = 8;
  double pyramid_scale = 1.2;
  int fast_threshold = 20;              ///< grey levels
  int fast_threshold_minimum = 7;       ///< where a cell has no corner at the first threshold
  double close_depth_m = 3.0;           ///< depth up to which a keyframe turns keypoints into landmarks at once
  int min_inliers = 30;                 ///< fewer: the pose is not trusted, the state becomes lost
  int keyframe_max_interval = 30;       ///< frames
  double keyframe_inlier_ratio = 0.85;  ///< of the reference keyframe's landmarks; fewer seen asks for a keyframe
  double new_map_after_s = 5.0;         ///< lost for so long, a new map is begun
};

struct MapperConfig {
  int max_keyframes = 1000;      ///< kept, of all maps
  int max_landmarks = 200'000;   ///< kept, of all maps
  int local_landmarks = 8000;    ///< in the snapshot the tracker sees
  int local_keyframes = 35;      ///< whose landmarks make the local map
  int recovery_keyframes = 20;   ///< of the local map, to match against when lost
  int bundle_keyframes = 30;     ///< moved by a local bundle adjustment; 0: none is made
  int bundle_iterations = 5;     ///< a round, of two
  double bundle_budget_s = 0.2;  ///< after which a local bundle adjustment is given up (not in lockstep)
  bool loop_closing = true;      ///< look for places seen before
  double drift_factor = 3.0;     ///< of a keyframe's own covariance in the drift that later poses inherit; slam/drift_model.h
  double loop_max_drift = 0.05;  ///< of the path in the map: a closure that asks for a larger correction is refused
};

enum class MapMode {
  Mapping,       ///< the map grows and is corrected
  Localization,  ///< the loaded map is used as it is
};

struct MapConfig {
  std::string file;              ///< loaded at start and saved; empty: neither
  double save_period_s = 300.0;  ///< 0: at shutdown and on request alone
  MapMode mode = MapMode::Mapping;
};

struct PublisherConfig {
  std::string url = "udpm://239.255.76.67:7667?ttl=0";
  std::string channel_prefix = "POSED_";
  double status_period_s = 1.0;
  double retry_period_s = 5.0;  ///< between attempts to start LCM
  bool bot_core_pose = false;   ///< also publish bot_core.pose_t of base, on <prefix>BOT_POSE
};

enum class ThreadPolicyName { Normal, Fifo, Deadline };

struct ThreadConfig {
  ThreadPolicyName policy = ThreadPolicyName::Normal;
  int priority = 0;
  std::vector<int> cpus;
};

struct PipelineConfig {
  int frame_slots = 16;
  int frame_queue = 2;     ///< frames waiting for the tracker before the oldest is dropped
  int keyframe_queue = 4;  ///< keyframes waiting for the mapper before none is made
  int publish_queue = 64;  ///< poses waiting for the publisher before the oldest is dropped
  bool lock_memory = false;
  ThreadConfig capture;
  ThreadConfig tracker;
  ThreadConfig mapper;
  ThreadConfig detector;
  ThreadConfig publisher;
};

struct LoggingConfig {
  std::string level = "info";
};

struct Config {
  SourceConfig source;
  CameraConfig camera;
  TrackerConfig tracker;
  MapperConfig mapper;
  MapConfig map;
  DetectorConfig detector;
  DynamicConfig dynamic;
  PublisherConfig publisher;
  GpioConfig gpio;
  PipelineConfig pipeline;
  LoggingConfig logging;

  CameraIntrinsics intrinsics;  ///< read from `camera.calibration`
};

}  // namespace posed
