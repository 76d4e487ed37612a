#include "slam/mover_table.h"

#include <algorithm>

#include "core/clock.h"

namespace posed {

namespace {

// A detector's looks add up to a person's strength as log-likelihoods do: a sure look gains, a miss loses, and boxes that come and
// go on furniture stay below what it takes to stand against all appearance.
constexpr float kStrengthCap = 4.0F;
constexpr float kFoundGain = 0.5F;
constexpr float kScoreGain = 3.0F;   // for each unit of score above...
constexpr float kPlainScore = 0.4F;  // ...this
constexpr float kMissedLoss = 0.2F;
constexpr float kSureStrength = 1.5F;
constexpr double kSureMemory = 2.0;  // times the memory of others
constexpr float kAllStatic = 0.7F;   // share of a person's cells that were there before, which makes them doubtful
constexpr float kMuchMoved = 0.2F;   // share of a mover's cells that have moved, which says that it walks
constexpr float kAnyMoved = 0.05F;   // share of cells that have moved, which confirms a mover

std::size_t needed(const MoverEvidence& evidence, float share) {
  return std::max(MoverTable::kLeastCells, static_cast<std::size_t>(share * static_cast<float>(evidence.cells)));
}

}  // namespace

bool MoverEvidence::walks() const {
  return moved > needed(*this, kMuchMoved);
}

std::uint8_t MoverTable::add(std::int64_t now_ns) {
  const auto free = std::find_if(movers_.begin() + 1, movers_.end(), [](const Mover& m) { return !m.alive; });
  if (free == movers_.end()) {
    return 0;
  }
  *free = Mover{};
  free->alive = true;
  free->confirmed_ns = now_ns;
  return static_cast<std::uint8_t>(free - movers_.begin());
}

void MoverTable::looked() {
  for (Mover& mover : movers_) {
    if (mover.person) {
      mover.strength -= kMissedLoss;  // whom the detector sees gets it back
    }
  }
}

void MoverTable::found(std::uint8_t number, float score, std::int64_t now_ns) {
  Mover& mover = movers_[number];
  mover.person = true;
  mover.strength = std::min(kStrengthCap, mover.strength + kMissedLoss + kFoundGain + kScoreGain * (score - kPlainScore));
  mover.sure = mover.sure || mover.strength >= kSureStrength;
  mover.confirmed_ns = now_ns;
}

void MoverTable::moved(std::uint8_t number, std::int64_t now_ns) {
  movers_[number].confirmed_ns = now_ns;
  movers_[number].moving = true;
}

void MoverTable::judge(const PerMover<MoverEvidence>& evidence, std::int64_t now_ns) {
  for (std::size_t number = 1; number < movers_.size(); ++number) {
    Mover& mover = movers_[number];
    const MoverEvidence& seen = evidence[number];
    mover.moving = seen.moved >= needed(seen, kAnyMoved);
    if (mover.alive && mover.moving) {
      mover.confirmed_ns = now_ns;
      mover.masked = true;
    } else if (mover.person) {
      const bool doubtful = static_cast<float>(seen.was_there) > kAllStatic * static_cast<float>(seen.cells);
      mover.masked = !doubtful || mover.sure;
    }
  }
}

bool MoverTable::forget(const PerMover<std::size_t>& area, std::int64_t now_ns) {
  bool any_died = false;
  for (std::size_t number = 1; number < movers_.size(); ++number) {
    Mover& mover = movers_[number];
    const double memory_s = memory_s_ * (mover.sure ? kSureMemory : 1.0);
    const bool tired = now_ns - mover.confirmed_ns > from_seconds(memory_s);
    if (mover.alive && (tired || area[number] < kLeastCells || (mover.strength < 0 && !mover.masked))) {
      mover = Mover{};
      any_died = true;
    }
  }
  return any_died;
}

void MoverTable::assign_person(std::uint8_t number, std::int64_t now_ns) {
  movers_.fill(Mover{});
  movers_[number] = Mover{.alive = true, .person = true, .strength = kStrengthCap, .sure = true, .confirmed_ns = now_ns};
}

}  // namespace posed
