#include "detect/box_fusion.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace posed {

namespace {

/// Of two boxes, the second of weight `share` and the first of the rest.
BoundingBox between(const BoundingBox& a, const BoundingBox& b, float share) {
  return {std::lerp(a.x_min, b.x_min, share), std::lerp(a.y_min, b.y_min, share), std::lerp(a.x_max, b.x_max, share),
          std::lerp(a.y_max, b.y_max, share)};
}

}  // namespace

BoxFusion::BoxFusion(float iou) : iou_(iou) {
  pairs_.reserve(Detections::kCapacity * Detections::kCapacity);
  joined_.reserve(2 * Detections::kCapacity);
}

void BoxFusion::add(const Detections& look, std::size_t looks_before, Detections& fused) {
  list_pairs(look, fused);
  const auto before = static_cast<float>(looks_before);
  std::array<bool, Detections::kCapacity> is_continued{};
  std::array<bool, Detections::kCapacity> is_known{};
  joined_.assign(fused.found().begin(), fused.found().end());
  for (const auto& [strength, i, j] : pairs_) {
    if (!is_continued[i] && !is_known[j]) {
      is_continued[i] = is_known[j] = true;
      Detection& person = joined_[i];
      const Detection& seen = look.people[j];
      person.box = between(person.box, seen.box, seen.score / (before * person.score + seen.score));
      person.score += seen.score / before;  // the sum of all looks, as of those not seen anew, over `before`
    }
  }
  const std::size_t known = joined_.size();
  for (std::size_t i = 0; i < look.count; ++i) {
    const Detection& seen = look.people[i];
    const auto is_another = [&](const Detection& d) { return intersection_over_union(seen.box, d.box) <= iou_; };
    if (!is_known[i] && std::all_of(joined_.begin(), joined_.begin() + static_cast<std::ptrdiff_t>(known), is_another)) {
      joined_.push_back({seen.box, seen.score / before});
    }
  }
  for (Detection& person : joined_) {
    person.score *= before / (before + 1);
  }
  order_by_confidence(joined_);
  fused.assign(joined_);
}

/// Boxes that may be of one person, the surest of them first.
void BoxFusion::list_pairs(const Detections& look, const Detections& fused) {
  pairs_.clear();
  for (std::size_t i = 0; i < fused.count; ++i) {
    for (std::size_t j = 0; j < look.count; ++j) {
      const float overlap = intersection_over_union(fused.people[i].box, look.people[j].box);
      if (overlap > iou_) {
        pairs_.push_back({overlap * std::sqrt(fused.people[i].score * look.people[j].score), i, j});
      }
    }
  }
  order_by_strength(pairs_);
}

}  // namespace posed
