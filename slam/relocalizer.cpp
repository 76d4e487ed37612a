#include "slam/relocalizer.h"

namespace posed {

namespace {

constexpr std::size_t kCandidates = 6;
constexpr double kSamePlace_m = 0.3;     // two confirmed poses nearer than this are one
constexpr double kAmbiguousShare = 0.8;  // of the best one's inliers: a second place confirmed so well makes both doubtful

}  // namespace

Relocalizer::Relocalizer(const TrackerConfig& tracker, const PinholeCamera& camera, const PlaceRecognizer& places, const Map& map)
    : min_inliers_(tracker.min_inliers), map_(map), search_(tracker, camera, places, map) {}

std::optional<Relocalizer::Found> Relocalizer::find(const KeyframeRecord& frame) {
  const auto anywhere = [](KeyframeId) { return true; };
  std::optional<Found> best;
  int best_inliers = 0;
  int rival_inliers = 0;  // of the best place that lies apart
  for (const auto& [keyframe, match] :
       search_.find(frame.features, frame.ideal_pixels, frame.depth_m, anywhere, {kCandidates, min_inliers_})) {
    const bool same_place = best && map_.find_keyframe(best->keyframe)->map_id == map_.find_keyframe(keyframe)->map_id &&
                            (best->T_map_camera.translation() - match.T_map_camera.translation()).norm() < kSamePlace_m;
    if (match.inliers > best_inliers) {
      rival_inliers = same_place ? rival_inliers : best_inliers;
      best_inliers = match.inliers;
      best = Found{keyframe, match.T_map_camera};
    } else if (!same_place && match.inliers > rival_inliers) {
      rival_inliers = match.inliers;
    }
  }
  return rival_inliers > kAmbiguousShare * best_inliers ? std::nullopt : best;
}

}  // namespace posed
