#pragma once

#include <string>

#include "slam/map.h"
#include "slam/map_io.h"

/// The rules that a map keeps, checked where one is read and, so that none is written that could not be read, where one is saved.
/// Each function says which rule is broken, or nothing. Reentrant.
namespace posed {

std::string broken_rule(const MapHeader& header);
std::string broken_rule(LandmarkId id, const Landmark& landmark);

/// Of the keyframe by itself: its links are checked as far as they stand in `map`, where the keyframe need not be yet.
std::string broken_rule(KeyframeId id, const Keyframe& keyframe, const MapHeader& header, const Map& map);

std::string broken_rule(KeyframeId id, const LoopConstraint& loop, const Map& map);

/// Parents, once all keyframes are there.
std::string broken_spanning_tree(const Map& map);

}  // namespace posed
