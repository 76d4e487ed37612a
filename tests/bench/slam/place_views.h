#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "core/se3.h"
#include "slam/features.h"

namespace posed {

/// What a place looked like from somewhere: the descriptors of one image, those of keypoints without depth left out.
struct PlaceView {
  std::int32_t room = 0;  ///< poses of different rooms have nothing to do with each other
  Se3 T_room_camera;
  std::vector<Descriptor> descriptors;
};

/// Keyframes to index and, each in the same room as some of them, views to look for.
struct PlaceViews {
  std::vector<PlaceView> keyframes;
  std::vector<PlaceView> queries;
};

/// Views of synthetic rooms, 320x240, each room a seed of its own: in every room the camera goes round once in `per_room`
/// keyframes, and `queries_per_room` queries are taken 0.1 to 0.3 m and 5 to 15 degrees beside one of them. Features are kept in a
/// file of the system's temporary folder, because rendering takes long. Ends the program with a message where that fails.
PlaceViews synthetic_place_views(int rooms, int per_room, int queries_per_room);

/// Views of a recording with ground truth: every tenth frame a keyframe, the frames in the middle between two of them queries, as
/// room `room`. Empty where the recording is not there.
PlaceViews recorded_place_views(const std::filesystem::path& sequence, std::int32_t room);

}  // namespace posed
