// How much of a saved map shows what moves: of its landmarks, and of the keyframes' sightings of them, the share that lies inside
// true masks. A landmark counts as inside where more than half of its sightings do.
//
//   map_masks MAP CAMERA.toml MASKS     (MASKS: a folder with one image a frame of the recording, by name in the order of the
//   frames)
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <unordered_map>
#include <vector>

#include <fmt/format.h>

#include "config/config.h"
#include "config/config_loader.h"
#include "drivers/image_file.h"
#include "slam/map_io.h"

namespace {

int fail(const posed::Error& error) {
  fmt::print(stderr, "map_masks: {}\n", error.message);
  return EXIT_FAILURE;
}

struct Sightings {
  int all = 0;
  int inside = 0;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    fmt::print(stderr, "usage: map_masks MAP CAMERA.toml MASKS\n");
    return 64;
  }
  const auto camera = posed::load_camera(argv[2]);
  if (!camera) {
    return fail(camera.error());
  }
  const posed::TrackerConfig tracker;
  posed::MapHeader expected;
  expected.camera = *camera;
  expected.pyramid_levels = tracker.pyramid_levels;
  expected.pyramid_scale = tracker.pyramid_scale;
  const auto loaded = posed::load_map(argv[1], expected);
  if (!loaded) {
    return fail(loaded.error());
  }
  std::vector<std::filesystem::path> masks;
  for (const auto& entry : std::filesystem::directory_iterator(argv[3])) {
    masks.push_back(entry.path());
  }
  std::sort(masks.begin(), masks.end());

  posed::ImageDecoder decoder;
  std::vector<std::uint8_t> bgr(3 * static_cast<std::size_t>(camera->width) * static_cast<std::size_t>(camera->height));
  std::vector<std::uint8_t> gray(bgr.size() / 3);
  const posed::ImageView<std::uint8_t> mask{gray.data(), camera->width, camera->height, camera->width, 1};
  std::unordered_map<posed::LandmarkId, Sightings> sightings;
  Sightings total;
  for (const auto& [id, keyframe] : loaded->map.keyframes()) {
    if (keyframe.sequence >= masks.size()) {
      fmt::print(stderr, "map_masks: {}: no mask for frame {}, there are {}\n", argv[3], keyframe.sequence, masks.size());
      return EXIT_FAILURE;
    }
    if (const auto read = decoder.read_color(
            masks[keyframe.sequence], {bgr.data(), camera->width, camera->height, std::ptrdiff_t{3} * camera->width, 3}, mask);
        !read) {
      return fail(read.error());
    }
    for (std::size_t i = 0; i < keyframe.landmarks.size(); ++i) {
      if (keyframe.landmarks[i] == posed::kNoLandmark) {
        continue;
      }
      const posed::Keypoint& keypoint = keyframe.features.keypoints[i];
      const int x = std::clamp(static_cast<int>(std::lround(keypoint.x)), 0, mask.width - 1);
      const int y = std::clamp(static_cast<int>(std::lround(keypoint.y)), 0, mask.height - 1);
      const int inside = mask.at(x, y) != 0 ? 1 : 0;
      for (Sightings* s : {&sightings[keyframe.landmarks[i]], &total}) {
        ++s->all;
        s->inside += inside;
      }
    }
  }
  const auto within = std::count_if(sightings.begin(), sightings.end(),
                                    [](const auto& entry) { return 2 * entry.second.inside > entry.second.all; });
  const auto percent = [](auto part, auto whole) {
    return whole > 0 ? 100.0 * static_cast<double>(part) / static_cast<double>(whole) : 0.0;
  };
  fmt::print("{} keyframes; {} landmarks, {:.2f} % inside; {} sightings, {:.2f} % inside\n", loaded->map.keyframes().size(),
             sightings.size(), percent(within, sightings.size()), total.all, percent(total.inside, total.all));
  return EXIT_SUCCESS;
}
