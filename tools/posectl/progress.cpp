#include "tools/posectl/progress.h"

#include <algorithm>
#include <cstddef>
#include <ostream>
#include <utility>

#include <fmt/ostream.h>

namespace posed {
namespace {

constexpr std::size_t kBarWidth = 30;
constexpr TimeNs kRedrawPeriod_ns = 100 * kNsPerMs;
constexpr std::uint64_t kSteps = 10;
constexpr std::uint64_t kFramesPerStep = 1000;  // where the total is unknown

}  // namespace

std::string format_progress(const ProgressState& state) {
  const double elapsed_s = to_seconds(state.elapsed_ns);
  const double rate_hz = elapsed_s > 0 ? static_cast<double>(state.done) / elapsed_s : 0.0;
  const std::string note = state.note.empty() ? "" : "  " + state.note;
  if (state.total == 0) {
    return fmt::format("{} frames  {:.1f} Hz{}", state.done, rate_hz, note);
  }
  const std::uint64_t done = std::min(state.done, state.total);
  const auto filled = static_cast<std::size_t>(done * kBarWidth / state.total);
  std::string line = fmt::format("[{:#<{}}{:.<{}}] {}/{}  {} %  {:.1f} Hz", "", filled, "", kBarWidth - filled, done, state.total,
                                 100 * done / state.total, rate_hz);
  if (done < state.total && rate_hz > 0) {
    line += fmt::format("  {:.0f} s left", static_cast<double>(state.total - done) / rate_hz);
  }
  return line + note;
}

ProgressReporter::ProgressReporter(std::ostream& err, Style style, std::string_view label, std::uint64_t total, TimeNs start_ns)
    : err_(err), style_(style), label_(label), total_(total), start_ns_(start_ns) {}

void ProgressReporter::update(std::uint64_t done, TimeNs now_ns, std::string note) {
  const ProgressState state{done, total_, now_ns - start_ns_, std::move(note)};
  if (style_ == Style::Bar && now_ns >= next_draw_ns_) {
    next_draw_ns_ = now_ns + kRedrawPeriod_ns;
    draw_bar(state);
  }
  if (style_ == Style::Lines) {
    const std::uint64_t steps = total_ == 0 ? done / kFramesPerStep : std::min(done, total_) * kSteps / total_;
    if (steps > steps_reported_) {
      steps_reported_ = steps;
      fmt::print(err_, "{} {}\n", label_, format_progress(state));
      err_.flush();
    }
  }
}

void ProgressReporter::finish(std::uint64_t done, TimeNs now_ns, std::string note) {
  if (style_ == Style::Bar) {
    draw_bar({done, total_, now_ns - start_ns_, std::move(note)});
    err_ << '\n';
    err_.flush();
    return;
  }
  update(done, now_ns, std::move(note));
}

void ProgressReporter::draw_bar(const ProgressState& state) {
  // Carriage return, the line, and erase to its end: a shorter line leaves nothing of a longer one.
  fmt::print(err_, "\r{} {}\x1b[K", label_, format_progress(state));
  err_.flush();
}

ProgressReporter::Style progress_style(bool is_terminal, bool quiet) {
  using Style = ProgressReporter::Style;
  return quiet ? Style::Quiet : is_terminal ? Style::Bar : Style::Lines;
}

}  // namespace posed
