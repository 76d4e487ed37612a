#pragma once

#include <vector>

#include "core/se3.h"
#include "slam/dynamic_mask.h"
#include "slam/keyframe_record.h"
#include "slam/map_snapshot.h"

namespace posed {

/// What a frame's depth says of the landmarks in its view: fills `record.hidden` and `record.refuted` (there they are described).
/// Bounded by the landmarks of `map`; does not allocate where the record has room. Reentrant.
void judge_visibility(const MapSnapshot& map, const DynamicMask& mask, const Se3& T_map_camera, KeyframeRecord& record);

}  // namespace posed
