#pragma once

#include <cstdint>
#include <iosfwd>
#include <string>
#include <string_view>

#include "core/clock.h"

namespace posed {

/// Work done so far, in frames.
struct ProgressState {
  std::uint64_t done = 0;
  std::uint64_t total = 0;  ///< 0 where unknown
  TimeNs elapsed_ns = 0;
  std::string note = {};  ///< stands at the end of the line
};

/// One line without its end: "[#####.....] 240/480  50 %  29.9 Hz  8 s left", or the count and the rate where the total is unknown.
/// Reentrant.
std::string format_progress(const ProgressState& state);

/// Shows how far a long command is: a bar redrawn in place on a terminal; elsewhere a line each tenth of the work (each thousand
/// frames where the total is unknown). Thread-bound.
class ProgressReporter {
 public:
  enum class Style { Quiet, Lines, Bar };

  ProgressReporter(std::ostream& err, Style style, std::string_view label, std::uint64_t total, TimeNs start_ns);
  ProgressReporter(const ProgressReporter&) = delete;
  ProgressReporter& operator=(const ProgressReporter&) = delete;

  void update(std::uint64_t done, TimeNs now_ns, std::string note = {});

  /// Leaves the bar with its last state on the terminal and moves to the next line.
  void finish(std::uint64_t done, TimeNs now_ns, std::string note = {});

 private:
  void draw_bar(const ProgressState& state);

  std::ostream& err_;
  Style style_;
  std::string label_;
  std::uint64_t total_;
  TimeNs start_ns_;
  TimeNs next_draw_ns_ = 0;
  std::uint64_t steps_reported_ = 0;
};

/// Bar on a terminal, lines elsewhere, nothing where the user asked for quiet. Reentrant.
ProgressReporter::Style progress_style(bool is_terminal, bool quiet);

}  // namespace posed
