#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/detections.h"
#include "core/result.h"
#include "detect/inference_engine.h"
#include "detect/network.h"

namespace posed {

/// How a network says where it sees what. B is a box's place in the output.
enum class HeadKind : std::uint8_t {
  Anchors,  ///< one {1, anchors * boxes an anchor * (5 + classes), h, w} each stride, raw: this project's models
  Boxes,    ///< {1, B, 5 + classes}: centre and size [pixels of the input], objectness, classes: YOLOv5 as Ultralytics exports it
  Yolox,    ///< {1, B, 5 + classes}: offset to the cell and logarithm of the size, in strides 8, 16, 32; scores: YOLOX
};

/// A box that a network gives, before suppression.
struct Candidate {
  Detection detection;
  std::size_t place = 0;  ///< that of its anchor in its cell: what an anchor's two boxes share, and nobody else
  friend bool operator==(const Candidate&, const Candidate&) = default;
};

/// Turns a network's outputs into boxes. The score of a box is its objectness times that of the class, and with a single class the
/// objectness alone, since there is nothing to tell apart. Redmon and Farhadi, "YOLOv3" (2018), for anchors; the bounded sizes,
/// (2 s(t))^2 anchors, are YOLOv5's; Ge et al., "YOLOX" (2021). Reentrant.
class BoxDecoder {
 public:
  /// `metadata` is asked for anchors and strides by HeadKind::Anchors alone; `wanted` is the class whose boxes count. Error:
  /// BadData, with what does not fit.
  static Result<BoxDecoder> create(HeadKind kind, TensorShape input, std::span<const InferenceOutput> outputs,
                                   const NetworkMetadata& metadata, int wanted);

  /// Overwrites `found` with all boxes of at least `score`, in pixels of the network's input, the first one from 0 to 1; no order.
  /// `found` keeps its capacity.
  void decode(std::span<const InferenceOutput> outputs, float score, std::vector<Candidate>& found) const;

 private:
  BoxDecoder() = default;
  void decode_anchors(const InferenceOutput& output, std::size_t head, std::size_t first_place, float score,
                      std::vector<Candidate>& found) const;
  void decode_rows(const InferenceOutput& output, float score, std::vector<Candidate>& found) const;
  Status check_anchors(std::span<const InferenceOutput> outputs, const NetworkMetadata& metadata);
  Status check_rows(std::span<const InferenceOutput> outputs);

  HeadKind kind_ = HeadKind::Anchors;
  TensorShape input_;
  int classes_ = 1;
  int wanted_ = 0;
  int boxes_per_anchor_ = 1;
  std::vector<int> strides_;
  std::vector<std::vector<Anchor>> anchors_;
};

/// Greedy non-maximum suppression: of boxes that overlap by more than `iou` the most confident stays, and an anchor's two boxes
/// spare each other, since they are of two people (Chu et al., "Detection in crowded scenes: one proposal, multiple predictions",
/// CVPR 2020, section 3.3). At most `limit` are kept, most confident first; ties are broken by coordinates and place, so that the
/// outcome does not depend on the order given. Reentrant.
void suppress_overlaps(std::vector<Candidate>& found, float iou, std::size_t limit);

}  // namespace posed
