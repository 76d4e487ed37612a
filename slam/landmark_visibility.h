#pragma once

#include <cstdint>
#include <span>

#include "core/se3.h"
#include "slam/dynamic_mask.h"
#include "slam/feature_frame.h"
#include "slam/keyframe_record.h"
#include "slam/map_snapshot.h"

namespace posed {

/// What a frame's depth says of the landmarks in its view: fills `record.hidden` and `record.refuted` (there they are described).
/// Bounded by the landmarks of `map`; does not allocate where the record has room. Reentrant.
void judge_visibility(const MapSnapshot& map, const DynamicMask& mask, const Se3& T_map_camera, KeyframeRecord& record);

/// Replaces the record's features, and what belongs to each, by those of the frame that lie on no mover: no map shall ever hold
/// one. `landmark_of`: by keypoint, an index into the map or kUnmatched; `mask` may be null. Reentrant.
void copy_static(const FeatureFrame& frame, std::span<const std::int32_t> landmark_of, const MapSnapshot& map,
                 const DynamicMask* mask, KeyframeRecord& record);

}  // namespace posed
