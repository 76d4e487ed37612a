#include "drivers/synthetic_renderer.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace posed {

namespace {

/// Where the four rays of a silhouette's pixel go, relative to its centre: a rotated grid, so that edges of any slope get all
/// steps.
constexpr float kSubPixelSize = 0.5F;
constexpr std::array<std::array<float, 2>, 4> kSubPixel{
    {{-0.125F, -0.375F}, {0.375F, -0.125F}, {0.125F, 0.375F}, {-0.375F, 0.125F}}};

CameraView view_from(const CameraIntrinsics& camera, const Se3& T_world_camera) {
  const Se3 T_camera_world = T_world_camera.inverse();
  return {.R_camera_world = T_camera_world.rotation_matrix().cast<float>(),
          .t_camera_world = T_camera_world.translation().cast<float>(),
          .fx = static_cast<float>(camera.fx),
          .fy = static_cast<float>(camera.fy),
          .cx = static_cast<float>(camera.cx),
          .cy = static_cast<float>(camera.cy)};
}

}  // namespace

SyntheticRenderer::SyntheticRenderer(const SyntheticWorld& world, const CameraIntrinsics& camera)
    : world_(world),
      camera_(camera),
      tiles_x_((camera.width + kTileWidth - 1) / kTileWidth),
      tiles_y_((camera.height + kTileHeight - 1) / kTileHeight),
      stride_(tiles_x_ * kTileWidth) {
  const auto pixels = static_cast<std::size_t>(stride_) * static_cast<std::size_t>(tiles_y_ * kTileHeight);
  ideal_x_.resize(pixels);
  ideal_y_.resize(pixels);
  object_.assign(pixels, kNothing);
  tiles_.resize(static_cast<std::size_t>(tiles_x_ * tiles_y_));

  const PinholeCamera lens(camera);
  for (int y = 0; y < tiles_y_ * kTileHeight; ++y) {
    for (int x = 0; x < stride_; ++x) {
      // What hangs over the image's edge in the last tiles sees what the edge sees.
      Eigen::Vector2d pixel(std::min(x, camera.width - 1), std::min(y, camera.height - 1));
      if (lens.is_distorted()) {
        pixel = lens.undistort(pixel);
      }
      const auto i = static_cast<std::size_t>(y * stride_ + x);
      ideal_x_[i] = static_cast<float>(pixel.x());
      ideal_y_[i] = static_cast<float>(pixel.y());
    }
  }
  for (int tile_y = 0; tile_y < tiles_y_; ++tile_y) {
    for (int tile_x = 0; tile_x < tiles_x_; ++tile_x) {
      PixelBox& box = tiles_[static_cast<std::size_t>(tile_y * tiles_x_ + tile_x)].bounds;
      box = {1e9F, 1e9F, -1e9F, -1e9F};
      for (int y = tile_y * kTileHeight; y < (tile_y + 1) * kTileHeight; ++y) {
        for (int x = tile_x * kTileWidth; x < (tile_x + 1) * kTileWidth; ++x) {
          const auto i = static_cast<std::size_t>(y * stride_ + x);
          // Half a pixel around the centres, for the rays of silhouettes.
          box = {std::min(box.min_x, ideal_x_[i] - 0.5F), std::min(box.min_y, ideal_y_[i] - 0.5F),
                 std::max(box.max_x, ideal_x_[i] + 0.5F), std::max(box.max_y, ideal_y_[i] + 0.5F)};
        }
      }
    }
  }
}

void SyntheticRenderer::view_world(double t_s, const Se3& T_world_camera) {
  const CameraView camera = view_from(camera_, T_world_camera);
  PixelBox image = tiles_.front().bounds;
  for (const Tile& tile : tiles_) {
    image = {std::min(image.min_x, tile.bounds.min_x), std::min(image.min_y, tile.bounds.min_y),
             std::max(image.max_x, tile.bounds.max_x), std::max(image.max_y, tile.bounds.max_y)};
  }
  const SyntheticScene& scene = world_.scene();
  quads_.clear();
  for (const TexturedQuad& quad : scene.quads) {
    ViewedQuad viewed;
    if (ViewedQuad::view(quad, scene.textures[quad.texture], camera, image, viewed)) {
      quads_.push_back(viewed);
    }
  }
  world_.body_parts(t_s, bodies_);
  parts_.clear();
  for (const BodyPart& part : bodies_) {
    ViewedPart viewed;
    if (ViewedPart::view(part, scene.textures[part.texture], camera, image, viewed)) {
      parts_.push_back(viewed);
    }
  }
}

void SyntheticRenderer::gather_row(int tile_y) {
  PixelBox row = tiles_[static_cast<std::size_t>(tile_y * tiles_x_)].bounds;
  for (int tile_x = 1; tile_x < tiles_x_; ++tile_x) {
    const PixelBox& tile = tiles_[static_cast<std::size_t>(tile_y * tiles_x_ + tile_x)].bounds;
    row = {std::min(row.min_x, tile.min_x), std::min(row.min_y, tile.min_y), std::max(row.max_x, tile.max_x),
           std::max(row.max_y, tile.max_y)};
  }
  row_quads_.clear();
  for (std::size_t i = 0; i < quads_.size(); ++i) {
    if (quads_[i].bounds.overlaps(row)) {
      row_quads_.push_back(static_cast<std::int32_t>(i));
    }
  }
  row_parts_.clear();
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    if (parts_[i].bounds.overlaps(row)) {
      row_parts_.push_back(static_cast<std::int32_t>(i));
    }
  }
}

void SyntheticRenderer::gather_tile(Tile& tile) {
  tile.begin = candidates_.size();
  // A quad that fills the tile hides everything that is farther than its own farthest point there.
  float hidden_below = 0;
  for (const std::int32_t i : row_quads_) {
    const ViewedQuad& quad = quads_[static_cast<std::size_t>(i)];
    const ViewedQuad::Overlap overlap = quad.overlap(tile.bounds);
    if (overlap == ViewedQuad::Overlap::None) {
      continue;
    }
    if (overlap == ViewedQuad::Overlap::Full) {
      hidden_below = std::max(hidden_below, quad.inverse_z.min_over(tile.bounds));
    }
    candidates_.push_back(i);
  }
  std::erase_if(candidates_, [&, position = std::size_t{0}](std::int32_t i) mutable {
    return position++ >= tile.begin && quads_[static_cast<std::size_t>(i)].inverse_z.max_over(tile.bounds) < hidden_below;
  });
  tile.quads = candidates_.size() - tile.begin;
  for (const std::int32_t i : row_parts_) {
    const ViewedPart& part = parts_[static_cast<std::size_t>(i)];
    if (part.bounds.overlaps(tile.bounds) && 1.0F / part.nearest_z >= hidden_below) {
      candidates_.push_back(i);
    }
  }
  tile.parts = candidates_.size() - tile.begin - tile.quads;
}

void SyntheticRenderer::cast_row(const Tile& tile, std::size_t offset, float* inverse_z, std::int32_t* object) const {
  const float* x = ideal_x_.data() + offset;
  const float* y = ideal_y_.data() + offset;
  std::fill_n(inverse_z, kTileWidth, 0.0F);
  std::fill_n(object, kTileWidth, kNothing);
  const std::int32_t* candidate = candidates_.data() + tile.begin;
  for (std::size_t k = 0; k < tile.quads; ++k) {
    const std::int32_t id = candidate[k];
    const ViewedQuad quad = quads_[static_cast<std::size_t>(id)];
    for (int i = 0; i < kTileWidth; ++i) {  // no branch inside, so that the compiler makes vectors of it
      const float w = quad.inverse_z(x[i], y[i]);
      const float u = quad.u_by_z(x[i], y[i]);
      const float v = quad.v_by_z(x[i], y[i]);
      const bool met =
          (w > inverse_z[i]) & (u >= quad.u_min * w) & (u <= quad.u_max * w) & (v >= quad.v_min * w) & (v <= quad.v_max * w);
      inverse_z[i] = met ? w : inverse_z[i];
      object[i] = met ? id : object[i];
    }
  }
  for (std::size_t k = 0; k < tile.parts; ++k) {
    const std::int32_t id = candidate[tile.quads + k];
    const ViewedPart& part = parts_[static_cast<std::size_t>(id)];
    for (int i = 0; i < kTileWidth; ++i) {
      if (part.bounds.contains(x[i], y[i])) {
        const float z = part.meet(x[i], y[i]);
        if (z > 0 && 1.0F / z > inverse_z[i]) {
          inverse_z[i] = 1.0F / z;
          object[i] = static_cast<std::int32_t>(quads_.size()) + id;
        }
      }
    }
  }
}

PackedBgr SyntheticRenderer::colour_of(std::int32_t object, float x, float y, float z, float pixel) const {
  const auto index = static_cast<std::size_t>(object);
  return index < quads_.size() ? quads_[index].colour(x, y, pixel) : parts_[index - quads_.size()].colour(x, y, z, pixel);
}

void SyntheticRenderer::cast_tile(const Tile& tile, int x0, int y0, ImageView<PackedBgr> colour, ImageView<float> depth_m,
                                  ImageView<std::uint8_t> person_mask) {
  std::array<float, kTileWidth> inverse_z;
  for (int y = y0; y < std::min(y0 + kTileHeight, camera_.height); ++y) {
    const auto offset = static_cast<std::size_t>(y * stride_ + x0);
    std::int32_t* object = object_.data() + offset;
    cast_row(tile, offset, inverse_z.data(), object);
    const int columns = std::min(kTileWidth, camera_.width - x0);
    for (int i = 0; i < columns; ++i) {
      const auto pixel = static_cast<std::size_t>(i);
      const bool met = object[i] != kNothing;
      const float z = met ? 1.0F / inverse_z[pixel] : 0.0F;
      depth_m.at(x0 + i, y) = z;
      colour.at(x0 + i, y) = met ? colour_of(object[i], ideal_x_[offset + pixel], ideal_y_[offset + pixel], z, 1.0F) : 0;
      if (!person_mask.empty()) {
        person_mask.at(x0 + i, y) = met && object[i] >= static_cast<std::int32_t>(quads_.size()) ? 255 : 0;
      }
    }
  }
}

PackedBgr SyntheticRenderer::cast(const Tile& tile, float x, float y) const {
  float nearest = 0;
  std::int32_t object = kNothing;
  const std::int32_t* candidate = candidates_.data() + tile.begin;
  for (std::size_t k = 0; k < tile.quads; ++k) {
    const ViewedQuad& quad = quads_[static_cast<std::size_t>(candidate[k])];
    const float w = quad.inverse_z(x, y);
    if (w <= nearest) {
      continue;
    }
    const float u = quad.u_by_z(x, y);
    const float v = quad.v_by_z(x, y);
    if (u >= quad.u_min * w && u <= quad.u_max * w && v >= quad.v_min * w && v <= quad.v_max * w) {
      nearest = w;
      object = candidate[k];
    }
  }
  for (std::size_t k = tile.quads; k < tile.quads + tile.parts; ++k) {
    const ViewedPart& part = parts_[static_cast<std::size_t>(candidate[k])];
    if (part.bounds.contains(x, y)) {
      const float z = part.meet(x, y);
      if (z > 0 && 1.0F / z > nearest) {
        nearest = 1.0F / z;
        object = static_cast<std::int32_t>(quads_.size()) + candidate[k];
      }
    }
  }
  return object == kNothing ? 0 : colour_of(object, x, y, 1.0F / nearest, kSubPixelSize);
}

void SyntheticRenderer::smooth_silhouettes(ImageView<PackedBgr> colour) const {
  for (int y = 0; y < camera_.height; ++y) {
    const std::int32_t* row = object_.data() + static_cast<std::ptrdiff_t>(y) * stride_;
    const std::int32_t* above = y > 0 ? row - stride_ : row;
    const std::int32_t* below = y + 1 < camera_.height ? row + stride_ : row;
    for (int x = 0; x < camera_.width; ++x) {
      const std::int32_t left = x > 0 ? row[x - 1] : row[x];
      const std::int32_t right = x + 1 < camera_.width ? row[x + 1] : row[x];
      if (row[x] == left && row[x] == right && row[x] == above[x] && row[x] == below[x]) {
        continue;
      }
      const Tile& tile = tiles_[static_cast<std::size_t>((y / kTileHeight) * tiles_x_ + x / kTileWidth)];
      const auto pixel = static_cast<std::size_t>(y * stride_ + x);
      std::uint32_t even = 0;
      std::uint32_t odd = 0;
      for (const auto& [dx, dy] : kSubPixel) {
        const PackedBgr c = cast(tile, ideal_x_[pixel] + dx, ideal_y_[pixel] + dy);
        even += c & 0x00ff00ffU;
        odd += c >> 8 & 0xffU;
      }
      colour.at(x, y) = ((even + 0x00020002U) >> 2 & 0x00ff00ffU) | ((odd + 2) >> 2) << 8;
    }
  }
}

void SyntheticRenderer::render(double t_s, const Se3& T_world_camera, ImageView<PackedBgr> colour, ImageView<float> depth_m,
                               ImageView<std::uint8_t> person_mask) {
  view_world(t_s, T_world_camera);
  candidates_.clear();
  for (int tile_y = 0; tile_y < tiles_y_; ++tile_y) {
    gather_row(tile_y);
    for (int tile_x = 0; tile_x < tiles_x_; ++tile_x) {
      Tile& tile = tiles_[static_cast<std::size_t>(tile_y * tiles_x_ + tile_x)];
      gather_tile(tile);
      cast_tile(tile, tile_x * kTileWidth, tile_y * kTileHeight, colour, depth_m, person_mask);
    }
  }
  smooth_silhouettes(colour);
}

}  // namespace posed
