#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "core/clock.h"

namespace posed {

/// Chooses among models ("rungs", from cheap to costly) the largest that fits a time budget while the machine's load changes.
///
/// What load does to one rung it does to the others, roughly: so a run of any rung tells of all. Each run gives the factor of its
/// time over that rung's time on the machine as it was at the start; the 95 % quantile of the factors of the last runs, times a
/// rung's own time, is that rung's expected p95. Rungs need no trial runs to be judged, and what is known of them never grows old.
/// Going up asks for a margin, so that the choice does not flutter. Reentrant.
class RungLadder {
 public:
  /// `unloaded_ns`: what a run of each rung takes when nothing else runs, ascending, at least one, each positive.
  RungLadder(std::vector<TimeNs> unloaded_ns, TimeNs budget_ns);

  /// The rung for the next frame; the cheapest where none fits.
  std::size_t rung() const { return rung_; }

  /// A run of `rung` that finished.
  void record_finished(std::size_t rung, TimeNs elapsed_ns);

  /// A run that was given up after `elapsed_ns`: it would have taken longer, but nobody knows by how much. It counts as half as
  /// long again.
  void record_abandoned(std::size_t rung, TimeNs elapsed_ns);

  /// p95 of what a run of `rung` takes now.
  TimeNs expected_p95_ns(std::size_t rung) const;

 private:
  static constexpr std::size_t kWindow = 32;  // runs: about a second

  void record(double factor);
  void choose();

  std::vector<TimeNs> unloaded_ns_;
  TimeNs budget_ns_;
  std::size_t rung_ = 0;
  std::array<double, kWindow> factors_{};  // a ring
  std::size_t count_ = 0;                  // ever recorded
  double factor_p95_ = 1;
};

}  // namespace posed
