#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "config/dynamic_config.h"
#include "core/detections.h"
#include "core/estimates.h"
#include "core/rgbd_frame.h"
#include "core/se3.h"
#include "slam/depth_grid.h"
#include "slam/free_space.h"
#include "slam/mover_labels.h"
#include "slam/mover_table.h"
#include "slam/person_segmentation.h"

namespace posed {

/// Which part of a frame shows what moves: people, whom a detector reports late and not in every frame, and other things, which
/// only their motion gives away. For each frame `begin` before its pose is sought, then `settle` with the pose.
///
/// Movers are sets of cells of the depth grid. From frame to frame their surface is carried along with the camera's motion and
/// accepted where the depth is as expected, then grows over connected surface by what something can move in the time. A detection
/// of an earlier frame is cut out by depth in that frame, which is remembered, and carried to the present in the same way; there it
/// confirms the mover it meets, or is a new one. After the pose is known, `FreeSpace` tells which cells have moved and which were
/// there before: the first make movers of their own, the others leave them (but not from the core of a person: who sits still is
/// no furniture). A mover that nothing confirms for a time is forgotten. Does not allocate after construction. Thread-bound.
class DynamicMask {
 public:
  struct Summary {
    float masked_share = 0;  ///< of the image, 0 to 1
    int people = 0;
    int others = 0;                ///< movers that no detection explains
    TimeNs detection_age_ns = -1;  ///< of the newest detections taken in; -1: none, or too old to matter
  };

  DynamicMask(const DynamicConfig& config, const PinholeCamera& camera);

  /// Takes the frame in, with its predicted pose and the newest detections known (of this or an earlier frame; null: none).
  void begin(const RgbdFrame& frame, const Se3& T_odom_camera, const Detections* newest);

  /// Judges the frame with its pose. True where cells have become movers since `begin`.
  bool settle(const Se3& T_odom_camera);

  /// The frame has no pose.
  void settle_lost();

  /// Whether the keypoint at pixel (x, y) [pixels as seen] with that depth [m; 0: none] lies on a mover.
  bool is_mover(float x, float y, float depth_m) const;

  /// One entry a cell, not 0 where the cell and all around it show movers: features there need not even be looked for.
  std::span<const std::uint8_t> interior() const { return interior_; }

  /// One entry a cell, not 0 where it shows a mover.
  std::span<const std::uint8_t> cells() const { return masked_; }

  const DepthGrid& depth() const { return newest().depth; }
  const GridCamera& camera() const { return camera_; }
  const Summary& summary() const { return summary_; }

  /// Writes the summary into the estimate's own fields.
  void report(PoseEstimate& estimate) const {
    estimate.masked_share = summary_.masked_share;
    estimate.people = summary_.people;
    estimate.other_movers = summary_.others;
    estimate.detection_age_ns = summary_.detection_age_ns;
  }

 private:
  struct Entry {
    explicit Entry(int width, int height) : depth(width, height), labels(depth.size(), 0) {}
    DepthGrid depth;
    std::vector<std::uint8_t> labels;
    Se3 T_odom_camera;
    std::uint64_t sequence = 0;
    std::int64_t stamp_ns = 0;
  };
  static constexpr std::size_t kHistory = 32;  // frames

  const Entry& newest() const { return history_[(taken_ + kHistory - 1) % kHistory]; }
  Entry& newest() { return history_[(taken_ + kHistory - 1) % kHistory]; }
  std::size_t find(std::uint64_t sequence) const;  // frames back from the newest one; kHistory: not there
  void take_in(const Detections& detections);
  void carry_to_present(std::size_t frames_back);
  void meet(float score);
  void trim(std::uint8_t id);
  void prune(Entry& now);
  bool add_moved(Entry& now);
  void forget_dead();
  void mask_boxes(const Detections& detections);
  void complete();

  DynamicConfig config_;
  int image_width_;
  GridCamera camera_;
  FreeSpace free_space_;
  PersonSegmentation segmentation_;
  MoverCarrier carrier_;
  MoverTable movers_;
  std::vector<Entry> history_;
  std::size_t taken_ = 0;
  std::uint64_t last_detection_ = 0;  // sequence number + 1 of the frame; 0: none
  std::vector<CellEvidence> evidence_;
  std::vector<std::uint8_t> carried_;  // one detection on its way to the present
  std::vector<std::uint8_t> carried_2_;
  std::vector<std::uint32_t> cells_;
  MoverReach reach_{};
  std::vector<std::uint8_t> masked_;
  std::vector<std::uint8_t> interior_;
  Summary summary_;
};

}  // namespace posed
