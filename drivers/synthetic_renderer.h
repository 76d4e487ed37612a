#pragma once

#include <cstdint>
#include <vector>

#include "core/image_view.h"
#include "core/pinhole_camera.h"
#include "drivers/synthetic_primitives.h"
#include "drivers/synthetic_world.h"

namespace posed {

/// Casts one ray a pixel into the world, and four where a silhouette runs through the pixel, so that edges are as smooth as a lens
/// makes them. Depth and person mask are those of the pixel's centre, exact to float's rounding. Works tile by tile: each tile
/// meets only the primitives whose bounds touch it and that no other hides there altogether. Lens distortion is in the rays. The
/// result depends on world, camera, pose and time alone. Thread-bound; no allocation once every part of the scene has been seen.
class SyntheticRenderer {
 public:
  /// `world` must outlive the renderer.
  SyntheticRenderer(const SyntheticWorld& world, const CameraIntrinsics& camera);

  /// Views the world of time `t_s` from `T_world_camera`. All views have the camera's size.
  /// `depth_m`: along z, never 0 inside the walls. `person_mask`: 255 on people, 0 elsewhere; may be empty.
  void render(double t_s, const Se3& T_world_camera, ImageView<PackedBgr> colour, ImageView<float> depth_m,
              ImageView<std::uint8_t> person_mask);

 private:
  static constexpr int kTileWidth = 16;
  static constexpr int kTileHeight = 8;
  static constexpr std::int32_t kNothing = -1;

  /// Candidates of one tile: [begin, begin + quads) of candidates_ are quads, then come `parts` parts.
  struct Tile {
    std::size_t begin = 0;
    std::size_t quads = 0;
    std::size_t parts = 0;
    PixelBox bounds{};
  };

  void view_world(double t_s, const Se3& T_world_camera);
  void gather_row(int tile_y);
  void gather_tile(Tile& tile);
  void cast_tile(const Tile& tile, int x0, int y0, ImageView<PackedBgr> colour, ImageView<float> depth_m,
                 ImageView<std::uint8_t> person_mask);
  void cast_row(const Tile& tile, std::size_t offset, float* inverse_z, std::int32_t* object) const;
  void smooth_silhouettes(ImageView<PackedBgr> colour) const;
  PackedBgr cast(const Tile& tile, float x, float y) const;
  PackedBgr colour_of(std::int32_t object, float x, float y, float z, float pixel) const;

  const SyntheticWorld& world_;
  CameraIntrinsics camera_;
  int tiles_x_;
  int tiles_y_;
  int stride_;                            ///< of the buffers below: whole tiles
  std::vector<float> ideal_x_, ideal_y_;  ///< a pixel's ideal place
  std::vector<std::int32_t> object_;      ///< what a pixel's centre shows: a quad, or quads_.size() + a part
  std::vector<Tile> tiles_;
  std::vector<std::int32_t> candidates_;
  std::vector<std::int32_t> row_quads_, row_parts_;
  std::vector<ViewedQuad> quads_;
  std::vector<ViewedPart> parts_;
  std::vector<BodyPart> bodies_;
};

}  // namespace posed
