#include "slam/dynamic_mask.h"

#include <algorithm>
#include <cmath>

#include "slam/surface.h"

namespace posed {

namespace {

constexpr double kReachPeriod_s = 0.034;  // in which a mover's edge moves by at most a cell more
constexpr int kMostReach = 5;             // [cells] a frame
constexpr float kSameMover = 0.3F;        // of the smaller of two areas: they overlap by more, so they are one
// A box below the first score makes nobody new: among those of the shipped networks are too many on furniture, and a wrong box
// costs more of the static scene than a look without any. Down to the second it confirms a mover that it meets, be it a person
// known from surer boxes or something that was only seen to move (Zhang et al., "ByteTrack", ECCV 2022, use boxes of low score so).
constexpr float kNewScore = 0.5F;
constexpr float kKnownScore = 0.4F;
constexpr int kMovedAround = 3;             // moved or masked neighbours without which a moved cell is taken for noise
constexpr int kMovedReach = 10;             // [cells] from what has moved, over connected surface that may have
constexpr int kTrimReach = 4;               // [cells] around a person's core, that stay theirs at a new detection
constexpr int kStillStep = 2;               // [cells] that a cell counts for which was there a moment ago
constexpr TimeNs kRecallNs = kNsPerSecond;  // a frame further back is not carried from

}  // namespace

DynamicMask::DynamicMask(const DynamicConfig& config, const PinholeCamera& camera)
    : config_(config),
      image_width_(camera.intrinsics().width),
      camera_(camera),
      free_space_(camera),
      segmentation_(camera),
      carrier_(camera),
      movers_(config.memory_s),
      history_(kHistory, Entry(camera.intrinsics().width, camera.intrinsics().height)) {
  const std::size_t cells = history_.front().labels.size();
  evidence_.assign(cells, CellEvidence::Unknown);
  carried_.assign(cells, 0);
  carried_2_.assign(cells, 0);
  cells_.reserve(cells);
  masked_.assign(cells, 0);
  interior_.assign(cells, 0);
}

std::size_t DynamicMask::find(std::uint64_t sequence) const {
  for (std::size_t back = 0; back < std::min(taken_, kHistory); ++back) {
    if (history_[(taken_ - 1 - back) % kHistory].sequence == sequence) {
      return back;
    }
  }
  return kHistory;
}

void DynamicMask::begin(const RgbdFrame& frame, const Se3& T_odom_camera, const Detections* newest_detections) {
  const bool first = taken_ == 0;
  ++taken_;
  Entry& now = newest();
  now.depth.assign(frame.depth_m);
  now.T_odom_camera = T_odom_camera;
  now.sequence = frame.sequence;
  now.stamp_ns = frame.stamp_utc_ns;
  std::fill(now.labels.begin(), now.labels.end(), std::uint8_t{0});
  if (!first) {
    const Entry& before = history_[(taken_ - 2) % kHistory];
    const double elapsed_s = to_seconds(now.stamp_ns - before.stamp_ns);
    const int reach = std::clamp(1 + static_cast<int>(std::lround(elapsed_s / kReachPeriod_s)), 1, kMostReach);
    for (std::uint8_t id = 1; id < reach_.size(); ++id) {
      reach_[id] = movers_[id].person || movers_[id].moving ? static_cast<std::uint8_t>(reach) : std::uint8_t{0};
    }
    carrier_.carry(before.depth, before.labels, T_odom_camera.inverse() * before.T_odom_camera, reach_, now.depth, now.labels);
  }
  summary_ = Summary{};
  const bool has_news = newest_detections != nullptr && newest_detections->image_width > 0;
  if (has_news && now.stamp_ns - newest_detections->stamp_utc_ns <= from_seconds(config_.max_detection_age_s)) {
    summary_.detection_age_ns = now.stamp_ns - newest_detections->stamp_utc_ns;
    if (config_.mode == DynamicMode::Boxes) {
      mask_boxes(*newest_detections);
    } else if (newest_detections->sequence + 1 != last_detection_) {
      last_detection_ = newest_detections->sequence + 1;
      take_in(*newest_detections);
    }
  }
  complete();
}

/// The source paper's way: all of the box.
void DynamicMask::mask_boxes(const Detections& detections) {
  Entry& now = newest();
  std::fill(now.labels.begin(), now.labels.end(), std::uint8_t{0});
  movers_.assign_person(1, now.stamp_ns);
  for (const Detection& d : detections.found()) {
    for (int row = 0; row < now.depth.rows(); ++row) {
      for (int column = 0; column < now.depth.columns(); ++column) {
        const float x = (static_cast<float>(column) + 0.5F) * DepthGrid::kCell;
        const float y = (static_cast<float>(row) + 0.5F) * DepthGrid::kCell;
        if (x >= d.box.x_min && x <= d.box.x_max && y >= d.box.y_min && y <= d.box.y_max) {
          now.labels[now.depth.cell(column, row)] = kPersonCore | 1;
        }
      }
    }
  }
}

void DynamicMask::take_in(const Detections& detections) {
  const std::size_t back = find(detections.sequence);
  if (back == kHistory || newest().stamp_ns - detections.stamp_utc_ns > kRecallNs) {
    return;
  }
  movers_.looked();
  const Entry& then = history_[(taken_ - 1 - back) % kHistory];
  for (const Detection& detection : detections.found()) {
    if (detection.score < kKnownScore) {
      break;  // they come most confident first
    }
    segmentation_.segment(then.depth, detection.box, cells_);
    if (cells_.size() < MoverTable::kLeastCells) {
      continue;
    }
    std::fill(carried_.begin(), carried_.end(), std::uint8_t{0});
    for (const std::uint32_t cell : cells_) {
      carried_[cell] = kPersonCore | 1;
    }
    carry_to_present(back);
    meet(detection.score);
  }
}

/// Moves `carried_` from an earlier frame through those after it.
void DynamicMask::carry_to_present(std::size_t frames_back) {
  reach_.fill(1);
  for (std::size_t back = frames_back; back > 0; --back) {
    const Entry& from = history_[(taken_ - 1 - back) % kHistory];
    const Entry& to = history_[(taken_ - back) % kHistory];
    carrier_.carry(from.depth, carried_, to.T_odom_camera.inverse() * from.T_odom_camera, reach_, to.depth, carried_2_);
    std::swap(carried_, carried_2_);
  }
}

/// Joins `carried_` with the mover it overlaps most, or makes it one.
void DynamicMask::meet(float score) {
  Entry& now = newest();
  MoverTable::PerMover<std::size_t> area{};
  MoverTable::PerMover<std::size_t> common{};
  std::size_t own = 0;
  for (std::size_t cell = 0; cell < carried_.size(); ++cell) {
    ++area[mover_of(now.labels[cell])];
    if (carried_[cell] != 0) {
      ++own;
      ++common[mover_of(now.labels[cell])];
    }
  }
  if (own < MoverTable::kLeastCells) {
    return;
  }
  const auto best = static_cast<std::size_t>(std::max_element(common.begin() + 1, common.end()) - common.begin());
  const bool known =
      static_cast<float>(common[best]) >= kSameMover * static_cast<float>(std::min(own, area[best])) && area[best] > 0;
  if (!known && score < kNewScore) {
    return;
  }
  const auto id = known ? static_cast<std::uint8_t>(best) : movers_.add(now.stamp_ns);
  if (id == 0) {
    return;  // more movers than anyone can tell apart
  }
  movers_.found(id, score, now.stamp_ns);
  for (std::size_t cell = 0; cell < carried_.size(); ++cell) {
    if (now.labels[cell] == (id | kPersonCore)) {
      now.labels[cell] = id;  // the newest box says what is the person's core; an earlier one may have held more
    }
    if (carried_[cell] != 0 && (now.labels[cell] == 0 || mover_of(now.labels[cell]) == id)) {
      now.labels[cell] = static_cast<std::uint8_t>(id | (carried_[cell] & kPersonCore));
    }
  }
  trim(id);
}

/// Each frame a mover may grow a little; what that has added up to ends not far from where the detection puts the person.
void DynamicMask::trim(std::uint8_t id) {
  Entry& now = newest();
  std::fill(carried_.begin(), carried_.end(), std::uint8_t{0});  // here: whether the cell stays
  cells_.clear();
  for (std::size_t cell = 0; cell < now.labels.size(); ++cell) {
    if (now.labels[cell] == (id | kPersonCore)) {
      carried_[cell] = 1;
      cells_.push_back(static_cast<std::uint32_t>(cell));
    }
  }
  std::size_t next = 0;
  for (int step = 0; step < kTrimReach; ++step) {
    for (const std::size_t end = cells_.size(); next < end; ++next) {
      now.depth.for_each_beside(cells_[next], [&](std::size_t to) {
        if (carried_[to] == 0 && now.labels[to] == id) {
          carried_[to] = 1;
          cells_.push_back(static_cast<std::uint32_t>(to));
        }
      });
    }
  }
  for (std::size_t cell = 0; cell < now.labels.size(); ++cell) {
    if (now.labels[cell] == id && carried_[cell] == 0) {
      now.labels[cell] = 0;
    }
  }
}

bool DynamicMask::settle(const Se3& T_odom_camera) {
  Entry& now = newest();
  now.T_odom_camera = T_odom_camera;
  if (config_.mode != DynamicMode::Full) {
    return false;
  }
  free_space_.judge(now.depth, T_odom_camera, now.stamp_ns, evidence_);
  prune(now);
  const bool more = add_moved(now);
  carrier_.fill_holes(now.depth, now.labels);
  forget_dead();
  complete();
  free_space_.remember(now.depth, masked_, T_odom_camera, now.stamp_ns);
  return more;
}

void DynamicMask::settle_lost() {
  free_space_.forget();
  if (config_.mode == DynamicMode::Full) {
    forget_dead();
    complete();
  }
}

/// What was there before is no mover's, unless a detector says so. Even then, where a person walks: of their core the lesser part
/// that was there before is the desk they pass.
void DynamicMask::prune(Entry& now) {
  const auto rested = [&](std::size_t cell) {
    return evidence_[cell] == CellEvidence::Static || evidence_[cell] == CellEvidence::Resting;
  };
  MoverTable::PerMover<MoverEvidence> counts{};
  for (std::size_t cell = 0; cell < now.labels.size(); ++cell) {
    const std::uint8_t label = now.labels[cell];
    const bool core = (label & kPersonCore) != 0;
    MoverEvidence& count = counts[mover_of(label)];
    ++count.cells;
    count.moved += evidence_[cell] == CellEvidence::Moved ? 1 : 0;
    count.was_there += evidence_[cell] == CellEvidence::Static || evidence_[cell] == CellEvidence::Still ? 1 : 0;
    count.core += core ? 1 : 0;
    count.rested_core += core && rested(cell) ? 1 : 0;
  }
  for (std::size_t cell = 0; cell < now.labels.size(); ++cell) {
    std::uint8_t& label = now.labels[cell];
    if (label == 0) {
      continue;
    }
    const MoverEvidence& count = counts[mover_of(label)];
    const bool person = movers_[mover_of(label)].person;
    bool leaves = rested(cell) && (!person || count.walks());
    if ((label & kPersonCore) != 0) {
      leaves = leaves && evidence_[cell] == CellEvidence::Static && 2 * count.rested_core < count.core;
    } else {
      leaves = leaves || evidence_[cell] == CellEvidence::Static || evidence_[cell] == CellEvidence::Still;
    }
    label = leaves ? std::uint8_t{0} : label;
  }
  movers_.judge(counts, now.stamp_ns);
}

/// Cells that have moved and belong to nobody: they go to the mover they touch, or are a new one.
bool DynamicMask::add_moved(Entry& now) {
  const auto is_moved = [&](std::size_t cell) {
    if (now.labels[cell] != 0 || evidence_[cell] != CellEvidence::Moved) {
      return false;
    }
    int around = 0;
    now.depth.for_each_around(cell,
                              [&](std::size_t c) { around += evidence_[c] == CellEvidence::Moved || now.labels[c] != 0 ? 1 : 0; });
    return around >= kMovedAround;
  };
  bool added = false;
  std::fill(carried_.begin(), carried_.end(), std::uint8_t{0});  // here: the distance from what has moved, plus 1
  for (std::size_t seed = 0; seed < now.labels.size(); ++seed) {
    if (carried_[seed] != 0 || !is_moved(seed)) {
      continue;
    }
    cells_.assign(1, static_cast<std::uint32_t>(seed));
    carried_[seed] = 1;
    std::size_t moved = 1;
    std::uint8_t met = 0;
    for (std::size_t next = 0; next < cells_.size(); ++next) {
      const std::size_t from = cells_[next];
      now.depth.for_each_beside(from, [&](std::size_t to) {
        if (!is_one_surface(now.depth[from], now.depth[to])) {
          return;
        }
        if (now.labels[to] != 0) {
          met = met == 0 ? mover_of(now.labels[to]) : met;
          return;
        }
        if (carried_[to] != 0 || evidence_[to] == CellEvidence::Static || evidence_[to] == CellEvidence::Resting) {
          return;
        }
        const bool seeds = is_moved(to);
        const int step = evidence_[to] == CellEvidence::Still ? kStillStep : 1;
        if (seeds || carried_[from] + step <= kMovedReach) {
          carried_[to] = seeds ? std::uint8_t{1} : static_cast<std::uint8_t>(carried_[from] + step);
          moved += seeds ? 1 : 0;
          cells_.push_back(static_cast<std::uint32_t>(to));
        }
      });
    }
    if (moved < MoverTable::kLeastCells && met == 0) {
      continue;
    }
    const std::uint8_t id = met != 0 ? met : movers_.add(now.stamp_ns);
    if (id == 0) {
      continue;
    }
    movers_.moved(id, now.stamp_ns);
    for (const std::uint32_t cell : cells_) {
      now.labels[cell] = id;
    }
    added = true;
  }
  return added;
}

void DynamicMask::forget_dead() {
  Entry& now = newest();
  MoverTable::PerMover<std::size_t> area{};
  for (const std::uint8_t label : now.labels) {
    ++area[mover_of(label)];
  }
  if (movers_.forget(area, now.stamp_ns)) {
    for (std::uint8_t& label : now.labels) {
      if (label != 0 && !movers_[mover_of(label)].alive) {
        label = 0;
      }
    }
  }
}

/// What the labels mean for features, and the summary.
void DynamicMask::complete() {
  const Entry& now = newest();
  std::size_t count = 0;
  for (std::size_t cell = 0; cell < masked_.size(); ++cell) {
    const std::uint8_t label = now.labels[cell];
    masked_[cell] = label != 0 && movers_[mover_of(label)].masked ? 1 : 0;
    count += masked_[cell];
  }
  for (std::size_t cell = 0; cell < masked_.size(); ++cell) {
    std::uint8_t inside = masked_[cell];
    if (inside != 0) {
      now.depth.for_each_around(cell, [&](std::size_t c) { inside = static_cast<std::uint8_t>(inside & masked_[c]); });
    }
    interior_[cell] = inside;
  }
  summary_.masked_share = static_cast<float>(count) / static_cast<float>(masked_.size());
  summary_.people = 0;
  summary_.others = 0;
  movers_.for_each([this](const Mover& mover) {
    if (mover.masked) {
      ++(mover.person ? summary_.people : summary_.others);
    }
  });
}

bool DynamicMask::is_mover(float x, float y, float depth_m) const {
  const DepthGrid& depth = this->depth();
  const int column = std::clamp(static_cast<int>((x + 0.5F) / DepthGrid::kCell), 0, depth.columns() - 1);
  const int row = std::clamp(static_cast<int>((y + 0.5F) / DepthGrid::kCell), 0, depth.rows() - 1);
  const std::size_t cell = depth.cell(column, row);
  if (interior_[cell] != 0) {
    return true;
  }
  if (masked_[cell] != 0) {
    // Beside a mover's edge the background shows in the same cell.
    return depth_m <= 0 || depth[cell] <= 0 || depth_m < depth[cell] + 2 * depth_tolerance_m(depth[cell]);
  }
  bool mover = false;
  depth.for_each_around(cell, [&](std::size_t c) {
    mover = mover || (masked_[c] != 0 &&
                      (depth_m <= 0 || (depth[c] > 0 && std::abs(depth_m - depth[c]) < 0.5F * depth_tolerance_m(depth[c]))));
  });
  return mover;
}

}  // namespace posed
