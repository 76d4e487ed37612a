#include "detect/person_memory.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace posed {

namespace {

constexpr float kSureScore = 0.5F;
constexpr float kSureOverlap = 0.3F;
constexpr float kUnsureOverlap = 0.5F;
constexpr float kRise = 1.5F;              // of the logarithm of the odds, for somebody who is surely seen just now
constexpr float kSureGain = 0.7F;          // of a sure box, against the prediction, in where somebody is
constexpr float kUnsureGain = 0.5F;        // of an unsure one
constexpr float kVelocityShare = 0.6F;     // of those, the gain of the velocity
constexpr float kUnseenSlowdown = 0.8F;    // a frame
constexpr TimeNs kUnseenNs = 170'000'000;  // after which somebody is forgotten: five frames at 30 Hz
constexpr TimeNs kGapNs = 500'000'000;     // between two frames, after which everybody is
constexpr float kLeastDoubt = 1e-4F;       // scores are kept so far from 0 and 1

Eigen::Array4f sides_of(const BoundingBox& box) {
  return {box.x_min, box.y_min, box.x_max, box.y_max};
}

BoundingBox box_of(const Eigen::Array4f& sides) {
  return {sides[0], sides[1], sides[2], sides[3]};
}

float with_odds_raised(float score, float rise) {
  const float doubtful = std::clamp(score, kLeastDoubt, 1 - kLeastDoubt);
  const float odds = doubtful / (1 - doubtful) * std::exp(rise);
  return odds / (1 + odds);
}

}  // namespace

PersonMemory::PersonMemory(TimeNs memory_ns) : memory_ns_(memory_ns) {
  people_.reserve(kMostPeople);
  pairs_.reserve(kMostPeople * Detections::kCapacity);
}

void PersonMemory::judge(Detections& found) {
  const std::int64_t elapsed_ns = found.stamp_utc_ns - newest_ns_;
  newest_ns_ = found.stamp_utc_ns;
  if (elapsed_ns <= 0 || elapsed_ns > kGapNs) {
    people_.clear();
  }
  const auto elapsed_s = static_cast<float>(to_seconds(elapsed_ns));
  predict(found, elapsed_s);
  person_of_.fill(kNobody);
  match(found, kSureScore, kSureOverlap);
  match(found, kUnsureScore, kUnsureOverlap);
  for (std::size_t i = 0; i < found.count; ++i) {
    Detection& detection = found.people[i];
    if (person_of_[i] != kNobody) {
      Person& person = people_[person_of_[i]];
      follow(person, detection, elapsed_s);
      detection = {box_of(person.sides), with_odds_raised(detection.score, rise(person))};
    } else if (detection.score >= kSureScore && people_.size() < kMostPeople) {
      const Eigen::Array4f sides = sides_of(detection.box);
      people_.push_back({sides, Eigen::Array4f::Zero(), newest_ns_, newest_ns_, true});
    }
  }
  std::erase_if(people_, [this](const Person& p) { return newest_ns_ - p.seen_ns > kUnseenNs; });
  order_by_confidence(std::span(found.people).first(found.count));
}

/// Where everybody should be by now, if they went on as they did.
void PersonMemory::predict(const Detections& found, float elapsed_s) {
  const Eigen::Array4f largest{static_cast<float>(found.image_width), static_cast<float>(found.image_height),
                               static_cast<float>(found.image_width), static_cast<float>(found.image_height)};
  for (Person& person : people_) {
    if (!person.is_met) {
      person.velocity *= kUnseenSlowdown;
    }
    person.is_met = false;
    person.sides = (person.sides + elapsed_s * person.velocity).max(-0.5F).min(largest - 0.5F);
  }
}

/// Of all pairs of a box and a person who are not matched yet, those that overlap most first, and of boxes in about the same place
/// the surest: an unsure one that happens to lie better would take the person away from it.
void PersonMemory::match(const Detections& found, float least_score, float least_overlap) {
  pairs_.clear();
  for (std::size_t i = 0; i < found.count; ++i) {
    for (std::size_t j = 0; j < people_.size() && found.people[i].score >= least_score; ++j) {
      const float overlap = intersection_over_union(found.people[i].box, box_of(people_[j].sides));
      if (overlap >= least_overlap) {
        pairs_.push_back({overlap * std::sqrt(found.people[i].score), i, j});
      }
    }
  }
  order_by_strength(pairs_);
  for (const auto& [strength, i, j] : pairs_) {
    if (person_of_[i] == kNobody && !people_[j].is_met) {
      person_of_[i] = j;
      people_[j].is_met = true;
    }
  }
}

void PersonMemory::follow(Person& person, const Detection& detection, float elapsed_s) const {
  const bool is_sure = detection.score >= kSureScore;
  const float gain = is_sure ? kSureGain : kUnsureGain;
  const Eigen::Array4f surprise = sides_of(detection.box) - person.sides;
  person.sides += gain * surprise;
  person.velocity += kVelocityShare * gain / elapsed_s * surprise;
  person.seen_ns = newest_ns_;
  person.surely_seen_ns = is_sure ? newest_ns_ : person.surely_seen_ns;
}

float PersonMemory::rise(const Person& person) const {
  const double age = static_cast<double>(newest_ns_ - person.surely_seen_ns) / static_cast<double>(memory_ns_);
  return kRise * static_cast<float>(std::exp(-age));
}

}  // namespace posed
