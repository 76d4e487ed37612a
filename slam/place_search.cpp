#include "slam/place_search.h"

#include <optional>
#include <utility>

namespace posed {

namespace {

constexpr std::size_t kAroundKeyframes = 10;  // whose landmarks a candidate is checked against
constexpr std::size_t kAroundLandmarks = 3000;

}  // namespace

PlaceSearch::PlaceSearch(const TrackerConfig& tracker, const PinholeCamera& camera, const PlaceRecognizer& places, const Map& map)
    : camera_(camera), places_(places), map_(map), verifier_(camera, tracker), frame_(camera, feature_capacity(tracker.features)) {}

LocalMap PlaceSearch::surroundings(KeyframeId keyframe) const {
  return select_local_map(map_, keyframe, kAroundKeyframes, kAroundLandmarks);
}

std::vector<ConfirmedPlace> PlaceSearch::find(const Features& features, const std::vector<Eigen::Vector2f>& ideal_pixels,
                                              const std::vector<float>& depth_m, const std::function<bool(KeyframeId)>& eligible,
                                              const Options& options) {
  std::vector<ConfirmedPlace> confirmed;
  places_.query(features.descriptors, options.candidates, eligible, candidates_);
  if (candidates_.empty()) {
    return confirmed;
  }
  frame_.place_stored(camera_, features, ideal_pixels, depth_m);
  for (const PlaceCandidate& candidate : candidates_) {
    write_local_map(map_, surroundings(candidate.keyframe), 1, around_);
    std::optional<PlaceMatch> match = verifier_.verify(around_, around_.keyframes.front(), frame_, options.min_inliers);
    if (match) {
      confirmed.push_back({candidate.keyframe, std::move(*match)});
    }
  }
  return confirmed;
}

}  // namespace posed
