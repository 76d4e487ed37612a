// How often the place recogniser finds the place, and at what cost, beside an exhaustive comparison of all descriptors.
//
//   place_recognition_bench [MAX_KEYFRAMES] [BRUTE_FORCE_QUERIES]
//
// Keyframes: 100 views of each of 50 synthetic rooms (place_views.h), one room after the other. A query shows one of them from 0.1
// to 0.3 m and 5 to 15 degrees beside it; right is every keyframe of the same room within 0.5 m and 25 degrees of the query's pose.
// Where the recording tum_fr1_xyz is present its views are added as one room more, and asked for too; right is there within 0.2 m
// and 15 degrees.
//
// The exhaustive comparison counts, for each keyframe, the pairs of descriptors that are each other's nearest and differ in at most
// 64 bits; it is asked a few of the same queries only (10 where not said otherwise), since it takes seconds each. Times are of one
// thread's processor time.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <time.h>
#include <vector>

#include "slam/hamming.h"
#include "slam/place_recognizer.h"
#include "tests/bench/slam/place_views.h"
#include "tests/support/recordings.h"

namespace posed {
namespace {

constexpr int kRooms = 50;
constexpr int kPerRoom = 100;
constexpr int kQueriesPerRoom = 20;
constexpr std::int32_t kRecordedRoom = 1000;
constexpr std::size_t kBest = 5;
constexpr std::size_t kMaxQueries = 300;

double thread_cpu_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

struct Collection {
  std::vector<PlaceView> keyframes;  // index i is keyframe i + 1
  std::vector<PlaceView> queries;

  bool is_right(const PlaceView& query, KeyframeId keyframe) const {
    const PlaceView& k = keyframes[keyframe - 1];
    if (k.room != query.room) {
      return false;
    }
    const bool recorded = k.room == kRecordedRoom;
    const Vector6d xi = (k.T_room_camera.inverse() * query.T_room_camera).log();
    const double distance_m = (k.T_room_camera.translation() - query.T_room_camera.translation()).norm();
    const double angle_deg = xi.head<3>().norm() * 180 / std::numbers::pi;
    return distance_m < (recorded ? 0.2 : 0.5) && angle_deg < (recorded ? 15 : 25);
  }
  bool has_right(const PlaceView& query) const {
    for (std::size_t k = 1; k <= keyframes.size(); ++k) {
      if (is_right(query, k)) {
        return true;
      }
    }
    return false;
  }
};

/// The first `size` keyframes, and the queries that have a right answer among them.
Collection take(const Collection& all, std::size_t size) {
  Collection part;
  part.keyframes.assign(all.keyframes.begin(), all.keyframes.begin() + static_cast<std::ptrdiff_t>(size));
  for (const PlaceView& q : all.queries) {
    if (part.has_right(q)) {
      part.queries.push_back(q);
    }
  }
  return part;
}

struct Recall {
  int asked = 0;
  int first = 0;
  int among_best = 0;
  double ms = 0;

  void count(const Collection& c, const PlaceView& query, const std::vector<PlaceCandidate>& found) {
    ++asked;
    const auto right = [&](const PlaceCandidate& p) { return c.is_right(query, p.keyframe); };
    first += !found.empty() && right(found.front()) ? 1 : 0;
    among_best += std::any_of(found.begin(), found.end(), right) ? 1 : 0;
  }
  void print(const char* name, std::size_t keyframes) const {
    std::printf("%6zu keyframes  %-12s %4d queries  recall@1 %.3f  recall@5 %.3f  %9.2f ms a query\n", keyframes, name, asked,
                static_cast<double>(first) / asked, static_cast<double>(among_best) / asked, ms / asked);
    std::fflush(stdout);
  }
};

/// Pairs of mutually nearest descriptors that differ in at most 64 bits.
int mutual_matches(const std::vector<Descriptor>& a, const std::vector<Descriptor>& b) {
  constexpr std::uint16_t kMaxDistance = 64;
  std::vector<std::uint16_t> distances(b.size());
  std::vector<std::uint16_t> column_distance(b.size(), kMaxDistance + 1);
  std::vector<std::size_t> column_row(b.size(), 0);
  std::vector<std::size_t> row_column(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    hamming_kernels().distances(a[i], b.data(), static_cast<int>(b.size()), distances.data());
    std::uint16_t least = kMaxDistance + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      if (distances[j] < least) {
        least = distances[j];
        row_column[i] = j;
      }
      if (distances[j] < column_distance[j]) {
        column_distance[j] = distances[j];
        column_row[j] = i;
      }
    }
  }
  int mutual = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    mutual += row_column[i] < b.size() && column_row[row_column[i]] == i ? 1 : 0;
  }
  return mutual;
}

Recall exhaustive(const Collection& c, std::size_t queries) {
  Recall recall;
  const double start_ms = thread_cpu_ms();
  const std::size_t asked = std::min(queries, c.queries.size());
  for (std::size_t i = 0; i < asked; ++i) {
    const PlaceView& q = c.queries[i * c.queries.size() / asked];
    std::vector<PlaceCandidate> found;
    for (std::size_t k = 0; k < c.keyframes.size(); ++k) {
      found.push_back({k + 1, static_cast<double>(mutual_matches(q.descriptors, c.keyframes[k].descriptors))});
    }
    std::partial_sort(found.begin(), found.begin() + kBest, found.end(), [](const auto& a, const auto& b) {
      return a.score != b.score ? a.score > b.score : a.keyframe < b.keyframe;
    });
    found.resize(kBest);
    recall.count(c, q, found);
  }
  recall.ms = thread_cpu_ms() - start_ms;
  return recall;
}

void measure(const Collection& c, std::size_t exhaustive_queries) {
  PlaceRecognizer index;
  std::vector<double> add_ms;
  for (std::size_t k = 0; k < c.keyframes.size(); ++k) {
    const double start_ms = thread_cpu_ms();
    index.add(k + 1, c.keyframes[k].descriptors);
    add_ms.push_back(thread_cpu_ms() - start_ms);
  }
  Recall all;
  Recall recorded;
  std::vector<PlaceCandidate> found;
  double slowest_ms = 0;
  const std::size_t asked = std::min(kMaxQueries, c.queries.size());
  for (std::size_t i = 0; i < asked; ++i) {
    const PlaceView& q = c.queries[i * c.queries.size() / asked];
    const double start_ms = thread_cpu_ms();
    index.query(
        q.descriptors, kBest, [](KeyframeId) { return true; }, found);
    const double ms = thread_cpu_ms() - start_ms;
    slowest_ms = std::max(slowest_ms, ms);
    for (Recall* r : {&all, q.room == kRecordedRoom ? &recorded : nullptr}) {
      if (r != nullptr) {
        r->ms += ms;
        r->count(c, q, found);
      }
    }
  }
  const auto keyframes = static_cast<double>(c.keyframes.size());
  double sum_ms = 0;
  for (const double ms : add_ms) {
    sum_ms += ms;
  }
  all.print("index", c.keyframes.size());
  if (recorded.asked > 0) {
    recorded.print("  recorded", c.keyframes.size());
  }
  std::printf("%41s slowest query %.2f ms, add %.3f ms (slowest %.2f), %.1f kB a keyframe\n", "", slowest_ms, sum_ms / keyframes,
              *std::max_element(add_ms.begin(), add_ms.end()), static_cast<double>(index.memory_bytes()) / keyframes / 1000);
  if (exhaustive_queries > 0) {
    exhaustive(c, exhaustive_queries).print("exhaustive", c.keyframes.size());
  }
}

}  // namespace
}  // namespace posed

int main(int argc, char** argv) {
  using namespace posed;
  const std::size_t most = argc > 1 ? static_cast<std::size_t>(std::atol(argv[1])) : 5000;
  const std::size_t exhaustive_queries = argc > 2 ? static_cast<std::size_t>(std::atol(argv[2])) : 10;
  PlaceViews synthetic = synthetic_place_views(kRooms, kPerRoom, kQueriesPerRoom);
  const PlaceViews recorded = recorded_place_views(recording_folder("tum_fr1_xyz"), kRecordedRoom);
  // The recording comes first: it is in every size of the index.
  Collection all{recorded.keyframes, recorded.queries};
  all.keyframes.insert(all.keyframes.end(), synthetic.keyframes.begin(), synthetic.keyframes.end());
  all.queries.insert(all.queries.end(), synthetic.queries.begin(), synthetic.queries.end());
  for (const std::size_t size : {100U, 300U, 1000U, 2000U, 5000U}) {
    if (size <= std::min(most, all.keyframes.size())) {
      measure(take(all, size), exhaustive_queries);
    }
  }
  return EXIT_SUCCESS;
}
