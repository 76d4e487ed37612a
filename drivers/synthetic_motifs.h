#pragma once

#include <span>

#include <Eigen/Core>

#include "drivers/synthetic_hash.h"
#include "drivers/synthetic_painter.h"

/// What the synthetic world's materials are painted from: colours, shapes and script drawn out of a stream of numbers. A caller
/// draws once a statement (or in braces, which are ordered): the arguments of a call are evaluated in no fixed order, and the
/// picture must not depend on the compiler. All reentrant.
namespace posed {

constexpr float kCoarseTexel_m = 0.005F;
constexpr float kFineTexel_m = 0.0025F;

/// Hue in [0, 1) on the colour circle, saturation and brightness in 0..1.
Colour from_hue(float hue, float saturation, float brightness);

/// Any hue, at most `saturation`, brightness from `dark` to `bright`.
Colour any_colour(HashRng& rng, float saturation, float dark, float bright);

/// Sizes spread evenly over the octaves between `low` and `high`.
float any_size(HashRng& rng, float low, float high);

/// Anywhere on the texture [m].
Eigen::Vector2f any_point(HashRng& rng, const TexturePainter& painter);

/// A rectangle, an ellipse or a triangle, turned any way; lengths in metres.
void any_shape(TexturePainter& painter, HashRng& rng, Eigen::Vector2f centre, float size, Colour colour, float opacity);

/// `count` shapes of sizes from `low_m` to `high_m` anywhere.
void scatter(TexturePainter& painter, HashRng& rng, int count, float low_m, float high_m, float opacity, float saturation);

/// Lines of made-up script in the rectangle at `origin`: each glyph is a hash's bits on a grid of 3 x 4 cells; metres.
void print_text(TexturePainter& painter, HashRng& rng, Eigen::Vector2f origin, Eigen::Vector2f size, float cell_m, Colour ink);

/// How many there are on the painter's area at this density.
int count_for(const TexturePainter& painter, float per_square_metre);

/// Something that stands on the floor and takes the light there; metres on the floor's texture, angle from x towards y.
struct FloorShadow {
  Eigen::Vector2f centre;
  Eigen::Vector2f half;
  float angle_rad = 0;
};

/// The shadows, and less light towards the walls.
void shade_floor(TexturePainter& painter, std::span<const FloorShadow> shadows);

/// A frame of `width` metres along the four edges.
void frame_border(TexturePainter& painter, float width, Colour colour);

}  // namespace posed
