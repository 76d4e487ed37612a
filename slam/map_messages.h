#pragma once

#include <cstddef>
#include <span>

#include <posed/map_header_t.hpp>
#include <posed/map_keyframe_t.hpp>
#include <posed/map_landmark_t.hpp>
#include <posed/map_loop_t.hpp>

#include "core/pinhole_camera.h"
#include "slam/map.h"
#include "slam/map_io.h"

/// From the map's values to the records of its file and back, bit by bit. Nothing is checked but sizes. All reentrant; those that
/// fill a message or value keep the capacity of its vectors.
namespace posed {

map_header_t to_message(const MapHeader& header, const Map& map);
MapHeader from_message(const map_header_t& message);

map_landmark_t to_message(LandmarkId id, const Landmark& landmark);
Landmark from_message(const map_landmark_t& message);

void fill_message(map_keyframe_t& message, KeyframeId id, const Keyframe& keyframe);
/// Undistorts the keypoints with `camera`; covisibility and loops stay empty.
Keyframe from_message(const map_keyframe_t& message, const PinholeCamera& camera);

/// Whether a payload has the size that its counts ask for, which must be known before lcm makes room for its arrays.
bool is_keyframe_sized(std::span<const std::uint8_t> payload);

map_loop_t to_message(KeyframeId keyframe, const LoopConstraint& loop);
LoopConstraint from_message(const map_loop_t& message);

}  // namespace posed
