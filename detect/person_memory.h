#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/clock.h"
#include "core/detections.h"
#include "detect/box_pairs.h"

namespace posed {

/// Who was there a moment ago. A network judges each image as if it were the first, and of two people of whom one passes behind the
/// other it becomes unsure; but where somebody was surely seen a moment before, an unsure box is more likely right. So the odds of
/// a box that continues somebody rise by a factor, the less the longer ago they were surely seen.
///
/// Sure boxes are matched to people first, by overlap with where those should be by now, then unsure ones to whoever is left
/// (Zhang et al., "ByteTrack: multi-object tracking by associating every detection box", ECCV 2022; there no score changes). The
/// sides of a box that continues somebody are a mean of the network's and of where they should be: of an alpha-beta filter
/// (Benedict and Bordner, "Synthesis of an optimal set of radar track-while-scan smoothing equations", IRE Transactions on
/// Automatic Control 7(4), 1962), since the network's boxes waver from frame to frame by more than people do. No box is made up
/// where the network sees none. Does not allocate after construction. Thread-bound.
class PersonMemory {
 public:
  static constexpr float kUnsureScore = 0.03F;  ///< a box below continues nobody

  /// `memory_ns`, above 0: in which the rise of the odds' logarithm fades to 1/e.
  explicit PersonMemory(TimeNs memory_ns);

  /// Judges the boxes of one frame, of which those from `kUnsureScore` on are wanted, and orders them anew. Frames come in the
  /// order of their stamps; one that does not, or comes late, finds nobody remembered.
  void judge(Detections& found);

 private:
  struct Person {
    Eigen::Array4f sides;     // at the newest frame, whether seen there or not, in the order of BoundingBox [pixels]
    Eigen::Array4f velocity;  // [pixels/s]
    std::int64_t seen_ns;
    std::int64_t surely_seen_ns;
    bool is_met;  // in the newest frame
  };
  static constexpr std::size_t kMostPeople = Detections::kCapacity;
  static constexpr std::size_t kNobody = kMostPeople;

  void predict(const Detections& found, float elapsed_s);
  void match(const Detections& found, float least_score, float least_overlap);
  void follow(Person& person, const Detection& detection, float elapsed_s) const;
  float rise(const Person& person) const;

  TimeNs memory_ns_;
  std::int64_t newest_ns_ = 0;
  std::vector<Person> people_;
  std::vector<BoxPair> pairs_;                                  // of a detection and one of people_
  std::array<std::size_t, Detections::kCapacity> person_of_{};  // of each detection
};

}  // namespace posed
