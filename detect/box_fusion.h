#pragma once

#include <cstddef>
#include <vector>

#include "core/detections.h"
#include "detect/box_pairs.h"

namespace posed {

/// Joins what several looks at one image found: weighted boxes fusion (Solovyev, Wang, Gabruseva, "Weighted boxes fusion:
/// ensembling boxes from different object detection models", Image and Vision Computing 107, 2021). A person's confidence is the
/// mean of the looks', 0 for one that does not see them; the box is the mean of the looks' boxes, weighted by confidence. Other
/// than there, a look finds a person once: pairs that overlap well and are sure go first. By overlap alone the unsure boxes around
/// a sure one would take its partner away.
///
/// Does not allocate after construction. Thread-bound.
class BoxFusion {
 public:
  /// Boxes that overlap by more than `iou` may be of one person.
  explicit BoxFusion(float iou);

  /// Joins one more look to what `looks_before` of them, at least one, found: `fused`, most confident first before and after.
  void add(const Detections& look, std::size_t looks_before, Detections& fused);

 private:
  void list_pairs(const Detections& look, const Detections& fused);

  float iou_;
  std::vector<BoxPair> pairs_;  // of a box fused so far and one of the look
  std::vector<Detection> joined_;
};

}  // namespace posed
