#pragma once

#include <string>
#include <vector>

#include "core/pinhole_camera.h"
#include "core/se3.h"

/// The parts of the configuration (config/config.h) that say which camera delivers frames and what lines are wired to it.
namespace posed {

/// What holds for every camera.
struct LiveConfig {
  double rate_hz = 30.0;
  double stall_timeout_s = 1.0;           ///< without a frame for so long, the camera is closed and opened again
  double retry_period_s = 1.0;            ///< longest wait between two attempts to open it; the first ones come sooner
  double max_stamp_difference_s = 0.016;  ///< colour and depth that differ by more are not paired
};

struct OpenNi2Config {
  std::string device;        ///< URI, "serial:NUMBER", or the path of an .oni recording; empty: the first camera found
  bool registration = true;  ///< let the device register depth to colour
  bool frame_sync = true;
  bool auto_exposure = true;
  bool auto_white_balance = true;
};

/// One V4L2 node.
struct V4l2Config {
  std::string device;
  std::string format = "auto";
  int buffers = 4;
  std::vector<std::string> controls;  ///< "name=value", in this order
};

/// The depth camera that stands beside a colour camera; `node.device` empty: there is none.
struct DepthNodeConfig {
  V4l2Config node;
  std::string calibration;      ///< file; empty: depth is registered to colour by the device
  Se3 T_camera_depth;           ///< depth camera's frame to the colour camera's
  CameraIntrinsics intrinsics;  ///< read from `calibration`
};

struct LibcameraConfig {
  std::string camera;  ///< its id; empty: the first one found
  int buffers = 4;
  std::vector<std::string> controls;
};

/// Lines of a GPIO chip, by offset; -1: not used.
struct GpioConfig {
  std::string chip;  ///< name, label, path or number; empty: no lines
  int status_line = -1;
  int enable_line = -1;
  int trigger_line = -1;
  bool status_active_low = false;
  bool enable_active_low = false;
  bool trigger_active_low = false;
  double trigger_rate_hz = 30.0;
  std::vector<int> waiting_ms = {1000, 1000};  ///< on, off, on, ...; one number: always on; none: off
  std::vector<int> initializing_ms = {500, 500};
  std::vector<int> tracking_ms = {1000};
  std::vector<int> lost_ms = {100, 100};
  std::vector<int> paused_ms = {50, 1950};
};

}  // namespace posed
