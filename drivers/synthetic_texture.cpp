#include "drivers/synthetic_texture.h"

#include <cassert>
#include <utility>

namespace posed {

namespace {

PackedBgr average(PackedBgr a, PackedBgr b, PackedBgr c, PackedBgr d) {
  PackedBgr result = 0;
  for (int shift = 0; shift < 24; shift += 8) {
    const PackedBgr sum = ((a >> shift) & 255U) + ((b >> shift) & 255U) + ((c >> shift) & 255U) + ((d >> shift) & 255U);
    result |= ((sum + 2) / 4) << shift;
  }
  return result;
}

}  // namespace

MipTexture::MipTexture(float width_m, float height_m, int width, int height, std::vector<PackedBgr> texels)
    : width_m_(width_m), height_m_(height_m), texels_(std::move(texels)) {
  assert(width > 0 && height > 0 && width % kGranularity == 0 && height % kGranularity == 0);
  assert(texels_.size() == static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  texels_.reserve(texels_.size() * 4 / 3 + kLevels);
  levels_[0] = {.offset = 0, .width = width, .height = height, .scale = 256.0F};
  for (std::size_t i = 1; i < levels_.size(); ++i) {
    const Level finer = levels_[i - 1];
    levels_[i] = {.offset = texels_.size(), .width = finer.width / 2, .height = finer.height / 2, .scale = finer.scale / 2};
    for (int y = 0; y < levels_[i].height; ++y) {
      for (int x = 0; x < levels_[i].width; ++x) {
        const std::size_t top = finer.offset + static_cast<std::size_t>(2 * y * finer.width + 2 * x);
        const std::size_t bottom = top + static_cast<std::size_t>(finer.width);
        texels_.push_back(average(texels_[top], texels_[top + 1], texels_[bottom], texels_[bottom + 1]));
      }
    }
  }
}

}  // namespace posed
