#include "daemon/progress_watch.h"

namespace posed {

namespace {

constexpr std::array<std::string_view, 5> kNames = {"capture", "tracker", "mapper", "detector", "publisher"};

}  // namespace

std::vector<ProgressWatch::Change> ProgressWatch::look(const ThreadProgress& progress) {
  struct Thread {
    TimeNs silent_ns;
    TimeNs deadline_ns;
  };
  const std::array<Thread, kNames.size()> threads = {{{progress.capture_ns, kCaptureDeadline_ns},
                                                      {progress.tracker_ns, kTrackerDeadline_ns},
                                                      {progress.mapper_ns, kMapperDeadline_ns},
                                                      {progress.detector_ns, kDetectorDeadline_ns},
                                                      {progress.publisher_ns, kPublisherDeadline_ns}}};
  std::vector<Change> changes;
  for (std::size_t i = 0; i < threads.size(); ++i) {
    const bool stuck = threads[i].silent_ns > threads[i].deadline_ns;
    if (stuck != stuck_[i]) {
      stuck_[i] = stuck;
      changes.push_back({kNames[i], stuck, threads[i].silent_ns});
    }
  }
  return changes;
}

std::string ProgressWatch::stuck() const {
  std::string names;
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if (stuck_[i]) {
      names += (names.empty() ? "" : ",");
      names += kNames[i];
    }
  }
  return names;
}

}  // namespace posed
