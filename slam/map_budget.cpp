#include "slam/map_budget.h"

#include <algorithm>
#include <vector>

namespace posed {

namespace {

constexpr int kLookedAt = 30;  // keyframes judged for one that goes

}  // namespace

MapBudget::MapBudget(const MapperConfig& config, const LocalMapper& mapper, Map& map)
    : config_(config), mapper_(mapper), map_(map) {}

std::optional<KeyframeId> MapBudget::excess_keyframe(KeyframeId newest) {
  const auto& keyframes = map_.keyframes();
  if (keyframes.size() <= static_cast<std::size_t>(config_.max_keyframes)) {
    return std::nullopt;
  }
  const auto& near_newest = map_.find_keyframe(newest)->covisible;
  std::optional<KeyframeId> least;
  double most_redundant = -1;
  auto it = keyframes.upper_bound(cursor_);
  int looked_at = 0;
  for (std::size_t walked = 0; walked < keyframes.size() && looked_at < kLookedAt; ++walked, ++it) {
    it = it == keyframes.end() ? keyframes.begin() : it;
    cursor_ = it->first;
    if (it->first == newest || (least && near_newest.contains(it->first))) {
      continue;
    }
    ++looked_at;
    const double redundancy = mapper_.redundancy(it->second) - (near_newest.contains(it->first) ? 1.0 : 0.0);
    if (redundancy > most_redundant) {
      most_redundant = redundancy;
      least = it->first;
    }
  }
  return least;
}

void MapBudget::limit_landmarks() {
  const auto most = static_cast<std::size_t>(config_.max_landmarks);
  for (std::size_t seen = 1; map_.landmark_count() > most; ++seen) {
    for (const LandmarkId id : map_.landmark_ids()) {
      if (map_.landmark_count() > most && map_.find_landmark(id)->observations.size() <= seen) {
        map_.remove_landmark(id);
      }
    }
  }
}

}  // namespace posed
