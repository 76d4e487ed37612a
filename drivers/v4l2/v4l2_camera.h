#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "config/config.h"
#include "drivers/camera.h"
#include "drivers/frame_pairer.h"
#include "drivers/v4l2/color_node.h"
#include "drivers/v4l2/depth_node.h"

namespace posed {

/// An RGB-D camera of two V4L2 nodes, whose images are paired by their stamps. Each image is converted from the driver's buffer
/// straight into the frame. A frame's stamp is the colour image's. Where one node is gone, the camera is.
class V4l2Camera final : public Camera {
 public:
  /// `source.v4l2.device` and `source.depth.node.device` are set. The system and the clock must outlive it.
  V4l2Camera(V4l2System& system, const SourceConfig& source, const CameraIntrinsics& color, const Clock& clock);
  ~V4l2Camera() override { close(); }

  const std::string& description() const override { return description_; }
  Status open() override;
  CameraRead read(RgbdFrame* frame, TimeNs timeout_ns) override;
  void close() noexcept override;
  const CameraMetrics& metrics() const override { return metrics_; }

 private:
  V4l2Stream& stream(PairSide side) { return side == PairSide::Color ? color_.stream() : depth_.stream(); }
  std::optional<CameraRead> take(PairSide side, RgbdFrame* frame);
  CameraRead deliver(const FramePairer::Outcome& pair, RgbdFrame* frame);
  void count_clocks();

  const Clock& clock_;
  std::string description_;
  TimeNs max_difference_ns_;
  V4l2System& system_;
  ColorNode color_;
  DepthNode depth_;
  FramePairer pairer_;
  PairSide counted_ = PairSide::Color;  // whose sequence counts the frames
  std::uint64_t clock_resets_ = 0;      // that metrics_ has
  CameraMetrics metrics_;
};

}  // namespace posed
