#include "drivers/frame_pairer.h"

#include <algorithm>
#include <cstdlib>

namespace posed {

namespace {

constexpr std::size_t index_of(PairSide side) {
  return static_cast<std::size_t>(side);
}

constexpr PairSide other_than(PairSide side) {
  return side == PairSide::Color ? PairSide::Depth : PairSide::Color;
}

}  // namespace

void FramePairer::Queue::pop_front(std::size_t count) {
  std::move(images_.begin() + static_cast<std::ptrdiff_t>(count), images_.begin() + static_cast<std::ptrdiff_t>(size_),
            images_.begin());
  size_ -= count;
}

void FramePairer::let_go(PairSide side, std::size_t count, Outcome& outcome) {
  Queue& queue = waiting_[index_of(side)];
  for (std::size_t i = 0; i < count; ++i) {
    outcome.let_go[outcome.let_go_count++] = {side, queue[i]};
  }
  queue.pop_front(count);
}

std::optional<std::size_t> FramePairer::partner_of(const UnpairedImage& image, PairSide other) const {
  const Queue& queue = waiting_[index_of(other)];
  std::optional<std::size_t> nearest;
  TimeNs least_ns = options_.max_difference_ns;
  for (std::size_t i = 0; i < queue.size(); ++i) {
    if (const TimeNs difference_ns = std::abs(queue[i].capture_ns - image.capture_ns); difference_ns <= least_ns) {
      nearest = i;
      least_ns = difference_ns;
    }
  }
  const bool next_is_nearer =
      nearest && queue[*nearest].capture_ns < image.capture_ns && 2 * least_ns > options_.period_ns[index_of(other)];
  return next_is_nearer ? std::nullopt : nearest;
}

void FramePairer::Outcome::stamp(RgbdFrame& frame, PairSide counted) const {
  frame.capture_ns = color.capture_ns;
  frame.depth_offset_ns = depth.capture_ns - color.capture_ns;
  frame.sequence = counted == PairSide::Depth ? depth.sequence : color.sequence;
}

FramePairer::Outcome FramePairer::add(PairSide side, const UnpairedImage& image) {
  Outcome outcome;
  Queue& own = waiting_[index_of(side)];
  const PairSide other = other_than(side);
  if (own.size() > 0 && image.capture_ns <= own[own.size() - 1].capture_ns) {
    let_go(side, own.size(), outcome);
  }
  if (const std::optional<std::size_t> partner = partner_of(image, other)) {
    const UnpairedImage found = waiting_[index_of(other)][*partner];
    outcome.paired = true;
    outcome.color = side == PairSide::Color ? image : found;
    outcome.depth = side == PairSide::Color ? found : image;
    let_go(side, own.size(), outcome);
    let_go(other, *partner, outcome);
    waiting_[index_of(other)].pop_front(1);
    return outcome;
  }
  const std::size_t capacity = std::clamp<std::size_t>(options_.capacity[index_of(side)], 1, kMost);
  if (own.size() >= capacity) {
    let_go(side, own.size() - capacity + 1, outcome);
  }
  own.push(image);
  return outcome;
}

void FramePairer::clear() {
  waiting_ = {};
}

}  // namespace posed
