#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/config.h"
#include "core/bounded_ring.h"
#include "core/file_descriptor.h"
#include "drivers/camera.h"
#include "drivers/frame_pairer.h"
#include "drivers/libcamera/color_camera.h"
#include "drivers/libcamera/sensor_stamps.h"
#include "drivers/v4l2/depth_node.h"

namespace posed {

/// An RGB-D camera of a colour camera by libcamera and a depth node by V4L2, whose images are paired by their stamps. Completed
/// images come on libcamera's thread and wait in a ring for the capture thread, which converts them straight from the camera's
/// buffers into the frame. A frame's stamp is the colour image's. Where one of the two is gone, the camera is.
class LibcameraCamera final : public Camera, private CompletionSink {
 public:
  /// The system and the clock must outlive it. `source.depth.node.device` is set.
  LibcameraCamera(std::unique_ptr<ColorCamera> color, V4l2System& system, const SourceConfig& source,
                  const CameraIntrinsics& intrinsics, const Clock& clock);
  ~LibcameraCamera() override { close(); }

  const std::string& description() const override { return description_; }
  Status open() override;
  CameraRead read(RgbdFrame* frame, TimeNs timeout_ns) override;
  void close() noexcept override;
  const CameraMetrics& metrics() const override { return metrics_; }

 private:
  static constexpr std::size_t kMostBuffers = 64;  // the configuration allows half of that

  void on_completed(const CompletedImage& image) noexcept override;
  void on_disconnected() noexcept override;
  void wake() noexcept;

  std::optional<CameraRead> take_color(RgbdFrame* frame);
  std::optional<CameraRead> take_depth(RgbdFrame* frame);
  std::optional<CameraRead> pair(PairSide side, const UnpairedImage& image, RgbdFrame* frame);
  CameraRead deliver(const FramePairer::Outcome& pair, RgbdFrame* frame);
  void give_back(PairSide side, std::uint32_t buffer);
  void count_clocks();

  const Clock& clock_;
  TimeNs max_difference_ns_;
  V4l2System& system_;
  std::unique_ptr<ColorCamera> color_;
  std::string description_;
  DepthNode depth_;
  MjpegDecoder mjpeg_;
  SensorStamps stamps_;
  FramePairer pairer_;
  PairSide counted_ = PairSide::Color;   // whose sequence counts the frames
  std::vector<std::size_t> bytes_used_;  // of the colour image in each buffer
  std::optional<Error> failed_;          // to be told by the next read
  std::uint64_t clock_resets_ = 0;       // that metrics_ has

  BoundedRing<CompletedImage> completed_;  // from libcamera's thread
  std::atomic<bool> disconnected_{false};
  FileDescriptor wake_;
  CameraMetrics metrics_;
};

}  // namespace posed
