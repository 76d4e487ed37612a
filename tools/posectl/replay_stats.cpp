#include "tools/posectl/replay_stats.h"

#include <algorithm>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "daemon/version.h"

namespace posed {
namespace {

nlohmann::ordered_json latency_json(const LatencySummary& summary) {
  return {{"p50", summary.p50_ms}, {"p95", summary.p95_ms},   {"p99", summary.p99_ms}, {"p999", summary.p999_ms},
          {"max", summary.max_ms}, {"mean", summary.mean_ms}, {"count", summary.count}};
}

std::string latency_line(std::string_view name, const LatencySummary& summary) {
  return fmt::format("{:<13}p50 {:.2f}  p95 {:.2f}  p99 {:.2f}  p99.9 {:.2f}  max {:.2f}  ({} measured)\n", name, summary.p50_ms,
                     summary.p95_ms, summary.p99_ms, summary.p999_ms, summary.max_ms, summary.count);
}

}  // namespace

std::uint64_t frames_delivered(const HealthReport& health) {
  return health.frames_captured + health.frames_no_slot + health.frames_missed;
}

std::uint64_t frames_dropped(const HealthReport& health) {
  return health.frames_dropped + health.frames_no_slot + health.frames_missed;
}

std::string to_json(const ReplayStats& stats) {
  const HealthReport& health = stats.health;
  const nlohmann::ordered_json json = {
      {"version", version()},
      {"source",
       {{"description", stats.source.description},
        {"width", stats.source.width},
        {"height", stats.source.height},
        {"rate_hz", stats.source.rate_hz},
        {"total_frames", stats.source.total_frames}}},
      {"pacing", stats.lockstep ? "lockstep" : "realtime"},
      {"interrupted", stats.interrupted},
      {"source_failed", health.source_failed},
      {"wall_s", stats.wall_s},
      {"frames", frames_delivered(health)},
      {"tracked", health.frames_tracked},
      {"lost", health.frames_lost},
      {"dropped", frames_dropped(health)},
      {"skipped", health.frames_skipped},
      {"residual_variance", stats.residual_variance},
      {"keyframes", health.keyframes},
      {"keyframes_delayed", health.keyframes_delayed},
      {"poses_published", health.poses_published},
      {"poses_dropped", health.poses_dropped},
      {"publish_errors", health.publish_errors},
      {"map_keyframes", health.map_keyframes},
      {"map_landmarks", health.map_landmarks},
      {"map_saves", health.map_saves},
      {"map_save_errors", health.map_save_errors},
      {"loops_closed", health.loops_closed},
      {"maps_joined", health.maps_joined},
      {"relocalizations", health.relocalizations},
      {"detector_model", health.detector_model},
      {"detected", health.detected},
      {"detections_abandoned", health.detections_abandoned},
      {"detector_errors", health.detector_errors},
      {"track_ms", latency_json(health.track)},
      {"latency_ms", latency_json(health.latency)},
      {"map_ms", latency_json(health.map)},
      {"detect_ms", latency_json(health.detect)},
      {"detect_overrun_ms", latency_json(health.detect_overrun)},
      {"peak_rss_bytes", health.peak_rss_bytes},
  };
  // Paths in the description need not be UTF-8, JSON must be.
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

std::string format_replay_summary(const ReplayStats& stats) {
  const HealthReport& health = stats.health;
  const std::uint64_t frames = frames_delivered(health);
  const double share = 100.0 * static_cast<double>(health.frames_tracked) / static_cast<double>(std::max<std::uint64_t>(1, frames));
  return fmt::format("{}{}\n", stats.source.description, stats.interrupted ? " (interrupted)" : "") +
         fmt::format("frames       {}: tracked {} ({:.1f} %), lost {}, dropped {}; skipped {}\n", frames, health.frames_tracked,
                     share, health.frames_lost, frames_dropped(health), health.frames_skipped) +
         fmt::format("residuals    variance {:.3f} of the noise model's\n", stats.residual_variance) +
         fmt::format("map          {} keyframes, {} landmarks\n", health.map_keyframes, health.map_landmarks) +
         latency_line("track [ms]", health.track) + latency_line("latency [ms]", health.latency) +
         latency_line("map [ms]", health.map) + (health.detected > 0 ? latency_line("detect [ms]", health.detect) : "") +
         fmt::format("time         {:.1f} s, {:.0f} MB at most\n", stats.wall_s, static_cast<double>(health.peak_rss_bytes) * 1e-6);
}

}  // namespace posed
