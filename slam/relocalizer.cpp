#include "slam/relocalizer.h"

#include "slam/local_map.h"

namespace posed {

namespace {

constexpr std::size_t kCandidates = 6;
constexpr std::size_t kAroundKeyframes = 10;  // whose landmarks a candidate is verified against
constexpr std::size_t kAroundLandmarks = 3000;
constexpr double kSamePlace_m = 0.3;     // two confirmed poses nearer than this are one
constexpr double kAmbiguousShare = 0.8;  // of the best one's inliers: a second place confirmed so well makes both doubtful

}  // namespace

Relocalizer::Relocalizer(const TrackerConfig& tracker, const PinholeCamera& camera, const PlaceRecognizer& places, const Map& map)
    : camera_(camera),
      min_inliers_(tracker.min_inliers),
      places_(places),
      map_(map),
      verifier_(camera, tracker),
      frame_(camera, feature_capacity(tracker.features)) {}

std::optional<Relocalizer::Found> Relocalizer::find(const KeyframeRecord& frame) {
  places_.query(
      frame.features.descriptors, kCandidates, [](KeyframeId) { return true; }, candidates_);
  frame_.place_stored(camera_, frame.features, frame.ideal_pixels, frame.depth_m);
  std::optional<Found> best;
  int best_inliers = 0;
  int rival_inliers = 0;  // of the best place that lies apart
  for (const PlaceCandidate& candidate : candidates_) {
    write_local_map(map_, select_local_map(map_, candidate.keyframe, kAroundKeyframes, kAroundLandmarks), 1, around_);
    const auto match = verifier_.verify(around_, around_.keyframes.front(), frame_, min_inliers_);
    if (!match) {
      continue;
    }
    const bool same_place = best && map_.find_keyframe(best->keyframe)->map_id == map_.find_keyframe(candidate.keyframe)->map_id &&
                            (best->T_map_camera.translation() - match->T_map_camera.translation()).norm() < kSamePlace_m;
    if (match->inliers > best_inliers) {
      rival_inliers = same_place ? rival_inliers : best_inliers;
      best_inliers = match->inliers;
      best = Found{candidate.keyframe, match->T_map_camera};
    } else if (!same_place && match->inliers > rival_inliers) {
      rival_inliers = match->inliers;
    }
  }
  return rival_inliers > kAmbiguousShare * best_inliers ? std::nullopt : best;
}

}  // namespace posed
