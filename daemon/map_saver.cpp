#include "daemon/map_saver.h"

#include <cerrno>
#include <filesystem>
#include <system_error>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>

#include "core/logging.h"

namespace posed {

MapSaver::MapSaver(KeyframeMapper& mapper, MapFiles files, TimeNs period_ns, const Clock& clock)
    : mapper_(mapper), files_(std::move(files)), period_ns_(period_ns), clock_(clock), last_save_ns_(clock.now_ns()) {}

Result<bool> MapSaver::load() {
  if (const Status folder = check_folder(); !folder) {
    return tl::unexpected<Error>(folder.error());
  }
  if (files_.load.empty()) {
    return false;
  }
  const Status loaded = mapper_.load(files_.load);
  if (loaded) {
    log_info("map loaded: {}: {} keyframes, {} landmarks", files_.load, mapper_.keyframe_count(), mapper_.landmark_count());
    return true;
  }
  Error error = loaded.error();
  if (error.code == ErrorCode::NotFound && files_.may_be_missing) {
    log_info("no map yet at {}: a new one begins", files_.load);
    return false;
  }
  if (error.code == ErrorCode::BadData || error.code == ErrorCode::Unsupported) {
    error.code = ErrorCode::InvalidConfig;  // no restart mends it
  }
  return tl::unexpected<Error>(std::move(error));
}

Status MapSaver::check_folder() const {
  if (files_.save.empty()) {
    return {};
  }
  const std::filesystem::path parent = std::filesystem::path(files_.save).parent_path();
  const std::filesystem::path folder = parent.empty() ? "." : parent;
  if (::access(folder.c_str(), W_OK | X_OK) != 0) {
    return make_error(
        ErrorCode::InvalidConfig,
        fmt::format("{}: the map cannot be saved there: {}: {}. Make the folder and let this user write to it, or choose "
                    "another file for the map",
                    files_.save, folder.string(), std::generic_category().message(errno)));
  }
  return {};
}

void MapSaver::save_if_due() {
  const std::uint64_t requested = requested_.load(std::memory_order_acquire);
  const TimeNs period_ns = period_ns_.load(std::memory_order_relaxed);
  const bool period_over = period_ns > 0 && changed_ && clock_.now_ns() - last_save_ns_ >= period_ns;
  if (can_save() && (requested != served_ || period_over)) {
    save(requested);
  }
}

void MapSaver::save_at_end() {
  if (can_save() && extended_) {
    save(requested_.load(std::memory_order_acquire));
  }
}

Status MapSaver::can_save() const {
  if (!files_.save.empty()) {
    return {};
  }
  return make_error(ErrorCode::InvalidConfig, files_.load.empty() ? "the map is not saved, for map.file is empty"
                                                                  : "the map is not saved, for map.mode is \"localization\"");
}

void MapSaver::save(std::uint64_t requested) {
  MapSaveOutcome outcome;
  outcome.served = requested;
  const TimeNs begin_ns = clock_.now_ns();
  if (mapper_.keyframe_count() == 0) {
    outcome.message = "nothing is mapped yet";  // and an earlier map is not replaced by it
  } else if (const Status saved = mapper_.save(files_.save); !saved) {
    errors_.add();
    outcome.message = saved.error().message;
    log_error("the map is not saved: {}", outcome.message);
  } else {
    outcome.ok = true;
    outcome.duration_ns = clock_.now_ns() - begin_ns;
    note_success(outcome);
  }
  served_ = requested;
  last_save_ns_ = clock_.now_ns();
  outcomes_.back() = std::move(outcome);
  outcomes_.publish();
}

void MapSaver::note_success(MapSaveOutcome& outcome) {
  saves_.add();
  changed_ = false;
  outcome.message = files_.save;
  outcome.keyframes = mapper_.keyframe_count();
  outcome.landmarks = mapper_.landmark_count();
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(files_.save, error);
  outcome.bytes = error ? 0 : bytes;
  log_info("map saved: {}: {} keyframes, {} landmarks, {} bytes, {:.0f} ms", files_.save, outcome.keyframes, outcome.landmarks,
           outcome.bytes, to_ms(outcome.duration_ns));
}

const MapSaveOutcome& MapSaver::newest_outcome() noexcept {
  outcomes_.refresh();
  return outcomes_.front();
}

void MapSaver::report(HealthReport& health) const {
  health.map_saves = saves_.value();
  health.map_save_errors = errors_.value();
}

}  // namespace posed
