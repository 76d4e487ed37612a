#pragma once

#include <cstdint>

#include "drivers/synthetic_path.h"
#include "drivers/synthetic_scene.h"

/// The places that the synthetic camera can be in. World frame: metres, z up, the origin on the floor in the middle of the shell.
/// Equal arguments build equal places. All reentrant.
namespace posed {

/// One furnished room of 6.2 x 5.2 m. `seats` chairs (at most SyntheticScene::kMaxSeats) stand free in it, the first ones towards
/// `heading_rad`; the middle stays empty.
SyntheticScene build_room(std::uint32_t seed, int seats, float heading_rad);

/// A scene and the closed way through it that the camera walks.
struct WalkedPlace {
  SyntheticScene scene;
  RoundedPath path;
};

/// A rectangular ring corridor, 1.9 m wide and 2.5 m high, 11.1 x 8.3 m outside, with doors, notice boards, pictures and things
/// that stand at the walls; the way along its middle is 30 m round.
WalkedPlace build_corridor(std::uint32_t seed);

/// An open-plan office, 10 x 8 m: four groups of desks with partitions 1.5 m high, and furniture along the walls. The way is 28.6 m
/// long; it meets some of its own legs again in the same direction, another in the opposite one.
WalkedPlace build_office(std::uint32_t seed);

/// Two rooms of 4.5 x 4.5 m, their middles 8.5 m apart, joined by a corridor of 4 m that looks like neither. One is the other
/// turned by half a turn around the world's z axis, to the last book; the way, too, is its own image under that turn, half a round
/// later.
WalkedPlace build_twin_rooms(std::uint32_t seed);

}  // namespace posed
