#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "slam/mover_labels.h"

namespace posed {

/// What is known of a mover, besides the cells that show it. Plain data.
struct Mover {
  bool alive = false;
  bool person = false;
  float strength = 0;             ///< how sure the detector is of this person, added up over its looks
  bool sure = false;              ///< it was sure once
  std::int64_t confirmed_ns = 0;  ///< by a detection, or by its motion
  bool masked = true;             ///< false: taken for a false detection, as long as nothing else speaks for it
  bool moving = true;             ///< its motion showed in the last frame
};

/// How many of a mover's cells say what of it, in one frame.
struct MoverEvidence {
  std::size_t cells = 0;
  std::size_t moved = 0;        ///< free before, or something else: it came here
  std::size_t was_there = 0;    ///< seen so before
  std::size_t core = 0;         ///< a detection says that they are a person's
  std::size_t rested_core = 0;  ///< of these, those that have been there for some time

  /// So many cells have moved that the mover walks, and what has been there before is not its own.
  bool walks() const;
};

/// Who moves: numbers from 1 on for labels of cells, and what speaks for each. A mover lives for as long as something confirms it;
/// of people the detector's looks add up, a sure look gains and a miss loses. Does not allocate. Thread-bound.
class MoverTable {
 public:
  /// By mover's number; number 0 is nobody.
  template <typename T>
  using PerMover = std::array<T, kMostMovers + 1>;

  static constexpr std::size_t kLeastCells = 6;  ///< of a mover

  /// `memory_s` as in `DynamicConfig`.
  explicit MoverTable(double memory_s) : memory_s_(memory_s) {}

  const Mover& operator[](std::uint8_t number) const { return movers_[number]; }

  /// A mover that something has just shown; 0: more of them than can be told apart.
  std::uint8_t add(std::int64_t now_ns);

  /// The detector has looked at a frame: `found` follows for each person whom it saw.
  void looked();
  void found(std::uint8_t number, float score, std::int64_t now_ns);

  /// Its motion showed.
  void moved(std::uint8_t number, std::int64_t now_ns);

  /// Judges all by the cells of a frame.
  void judge(const PerMover<MoverEvidence>& evidence, std::int64_t now_ns);

  /// Those die whom nothing has confirmed for too long, or of whom nothing is seen. `area`: cells of each. True where one did.
  bool forget(const PerMover<std::size_t>& area, std::int64_t now_ns);

  /// Only one person, of whom the detector is sure.
  void assign_person(std::uint8_t number, std::int64_t now_ns);

  /// Calls `f(mover)` for each that is alive.
  template <typename F>
  void for_each(F&& f) const {
    for (const Mover& mover : movers_) {
      if (mover.alive) {
        f(mover);
      }
    }
  }

 private:
  double memory_s_;
  PerMover<Mover> movers_{};  // the first one stays nobody's
};

}  // namespace posed
