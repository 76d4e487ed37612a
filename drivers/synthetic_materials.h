#pragma once

#include <cstdint>
#include <span>

#include <Eigen/Core>

#include "drivers/synthetic_motifs.h"
#include "drivers/synthetic_texture.h"

/// The synthetic worlds' surfaces, painted from integer hashes: rich in corners of every size that a camera resolves at 0.6 to 5 m,
/// and nowhere repeating, so that every place looks like itself alone. Equal arguments paint equal textures. All reentrant.
namespace posed {

/// Plaster with a stencilled, irregular pattern, darker towards the room's edges.
MipTexture paint_wall(float width_m, float height_m, std::uint32_t seed);

/// Something to hang on a wall: an abstract, a page of print, a mosaic or a landscape.
MipTexture paint_poster(float width_m, float height_m, std::uint32_t seed);

/// Carpet of irregular tiles with a patterned rug in the middle.
MipTexture paint_floor(float width_m, float height_m, std::span<const FloorShadow> shadows, std::uint32_t seed);

/// Speckled vinyl in large sheets, scuffed by shoes: the floor of a corridor or an office.
MipTexture paint_vinyl_floor(float width_m, float height_m, std::span<const FloorShadow> shadows, std::uint32_t seed);

MipTexture paint_ceiling(float width_m, float height_m, std::uint32_t seed);

/// Cardboard or book covers with labels and print: faces of boxes take windows of it.
MipTexture paint_cardboard(float width_m, float height_m, std::uint32_t seed);
MipTexture paint_covers(float width_m, float height_m, std::uint32_t seed);

MipTexture paint_wood(float width_m, float height_m, std::uint32_t seed);
MipTexture paint_upholstery(float width_m, float height_m, std::uint32_t seed);

/// A screen that shows windows and text.
MipTexture paint_screen(float width_m, float height_m, std::uint32_t seed);

/// A door leaf with panels, a name plate, a handle and a note or two.
MipTexture paint_door(float width_m, float height_m, std::uint32_t seed);

/// Cork with pages pinned to it.
MipTexture paint_notice_board(float width_m, float height_m, std::uint32_t seed);

/// What people wear and are; u goes once around the limb with the front at the middle, v along it.
MipTexture paint_shirt(float width_m, float height_m, std::uint32_t seed);
MipTexture paint_trousers(float width_m, float height_m, std::uint32_t seed);
MipTexture paint_head(float width_m, float height_m, std::uint32_t seed);
MipTexture paint_skin(float width_m, float height_m, std::uint32_t seed);
MipTexture paint_hair(float width_m, float height_m, std::uint32_t seed);

}  // namespace posed
