#include "drivers/tum_sequence.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <queue>
#include <string_view>
#include <system_error>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "drivers/file_io.h"

namespace posed {

namespace {

namespace fs = std::filesystem;

constexpr TimeNs kPeriodOfSingleFrameNs = kNsPerSecond / 30;

/// Both lists merged by stamp as a doubly linked list. The two closest entries of different kinds that remain are always neighbours
/// in it (stamps are unique within a list, so whatever stood between them would be closer to one of them), which makes the greedy
/// choice over all pairs a walk along neighbours.
class GreedyPairing {
 public:
  GreedyPairing(const std::vector<TumListEntry>& color, const std::vector<TumListEntry>& depth, std::int64_t max_difference_ns)
      : max_difference_ns_(max_difference_ns) {
    nodes_.reserve(color.size() + depth.size());
    for (std::size_t c = 0, d = 0; c < color.size() || d < depth.size();) {
      const bool take_color = d == depth.size() || (c < color.size() && color[c].stamp_ns <= depth[d].stamp_ns);
      const int here = static_cast<int>(nodes_.size());
      nodes_.push_back({take_color ? &color[c++] : &depth[d++], take_color, here - 1, here + 1});
    }
    if (!nodes_.empty()) {
      nodes_.back().next = kNone;
    }
    for (int i = 0; i + 1 < static_cast<int>(nodes_.size()); ++i) {
      consider(i, i + 1);
    }
  }

  std::vector<TumAssociation> run() {
    std::vector<TumAssociation> pairs;
    while (!candidates_.empty()) {
      const Candidate best = candidates_.top();
      candidates_.pop();
      if (node(best.color).paired || node(best.depth).paired) {
        continue;
      }
      pairs.push_back({*node(best.color).entry, *node(best.depth).entry});
      remove(best.color);
      remove(best.depth);
    }
    std::sort(pairs.begin(), pairs.end(),
              [](const TumAssociation& a, const TumAssociation& b) { return a.color.stamp_ns < b.color.stamp_ns; });
    return pairs;
  }

 private:
  static constexpr int kNone = -1;

  struct Node {
    const TumListEntry* entry;
    bool is_color;
    int previous;
    int next;
    bool paired = false;
  };
  struct Candidate {
    std::int64_t difference_ns;
    std::int64_t color_stamp_ns;
    std::int64_t depth_stamp_ns;
    int color;
    int depth;
    bool operator>(const Candidate& other) const {
      return std::tie(difference_ns, color_stamp_ns, depth_stamp_ns) >
             std::tie(other.difference_ns, other.color_stamp_ns, other.depth_stamp_ns);
    }
  };

  Node& node(int i) { return nodes_[static_cast<std::size_t>(i)]; }

  void consider(int earlier, int later) {
    if (node(earlier).is_color == node(later).is_color) {
      return;
    }
    const std::int64_t difference_ns = node(later).entry->stamp_ns - node(earlier).entry->stamp_ns;
    if (difference_ns <= max_difference_ns_) {
      const int color = node(earlier).is_color ? earlier : later;
      const int depth = node(earlier).is_color ? later : earlier;
      candidates_.push({difference_ns, node(color).entry->stamp_ns, node(depth).entry->stamp_ns, color, depth});
    }
  }

  /// Takes an entry out; its neighbours become neighbours of each other.
  void remove(int i) {
    node(i).paired = true;
    const int previous = node(i).previous;
    const int next = node(i).next;
    if (previous != kNone) {
      node(previous).next = next;
    }
    if (next != kNone) {
      node(next).previous = previous;
    }
    if (previous != kNone && next != kNone) {
      consider(previous, next);
    }
  }

  std::int64_t max_difference_ns_;
  std::vector<Node> nodes_;
  std::priority_queue<Candidate, std::vector<Candidate>, std::greater<>> candidates_;
};

TimeNs median_interval(const std::vector<TumAssociation>& pairs) {
  std::vector<TimeNs> intervals;
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    intervals.push_back(pairs[i].color.stamp_ns - pairs[i - 1].color.stamp_ns);
  }
  if (intervals.empty()) {
    return kPeriodOfSingleFrameNs;
  }
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  return *middle;
}

Result<std::string> read_text(const fs::path& path) {
  std::vector<std::uint8_t> bytes;
  if (Status read = read_file(path, bytes); !read) {
    return tl::unexpected(std::move(read.error()));
  }
  return std::string(bytes.begin(), bytes.end());
}

/// What a list of either kind has to say besides its entries.
template <typename List>
void take_notes(List& list, TumSequence& sequence) {
  std::move(list.skipped_lines.begin(), list.skipped_lines.end(), std::back_inserter(sequence.skipped_lines));
  if (!list.unsorted.empty()) {
    sequence.warnings.push_back(std::move(list.unsorted));
  }
}

Result<TumList> read_list(const fs::path& path) {
  const Result<std::string> text = read_text(path);
  if (!text) {
    Error error = text.error();
    if (error.code == ErrorCode::NotFound) {
      error.message += "; a recording in the TUM RGB-D layout holds rgb.txt and depth.txt, or name an associations file";
    }
    return tl::unexpected(std::move(error));
  }
  return parse_tum_list(*text, path);
}

Status load_lists(double max_stamp_difference_s, TumSequence& sequence) {
  sequence.color_list = sequence.folder / "rgb.txt";
  sequence.depth_list = sequence.folder / "depth.txt";
  Result<TumList> color = read_list(sequence.color_list);
  if (!color) {
    return tl::unexpected(std::move(color.error()));
  }
  Result<TumList> depth = read_list(sequence.depth_list);
  if (!depth) {
    return tl::unexpected(std::move(depth.error()));
  }
  sequence.pairs = pair_by_stamp(color->entries, depth->entries, std::llround(max_stamp_difference_s * 1e9));
  sequence.unpaired = color->entries.size() - sequence.pairs.size();
  if (sequence.pairs.empty()) {
    return make_error(ErrorCode::BadData,
                      fmt::format("no stamp of {} ({} images, {} to {}) lies within {} s of one of {} ({} images, {} to {})",
                                  sequence.color_list.string(), color->entries.size(),
                                  format_stamp(color->entries.front().stamp_ns), format_stamp(color->entries.back().stamp_ns),
                                  max_stamp_difference_s, sequence.depth_list.string(), depth->entries.size(),
                                  format_stamp(depth->entries.front().stamp_ns), format_stamp(depth->entries.back().stamp_ns)));
  }
  take_notes(*color, sequence);
  take_notes(*depth, sequence);
  return {};
}

Status load_associations(const fs::path& name, TumSequence& sequence) {
  const fs::path inside = sequence.folder / name;
  std::error_code ignored;
  const fs::path path = fs::exists(inside, ignored) ? inside : name;
  const Result<std::string> text = read_text(path);
  if (!text) {
    Error error = text.error();
    if (error.code == ErrorCode::NotFound) {
      error.message =
          fmt::format("associations file not found: looked for {} and {}", inside.string(), fs::absolute(name).string());
    }
    return tl::unexpected(std::move(error));
  }
  Result<TumAssociationList> list = parse_tum_associations(*text, path);
  if (!list) {
    return tl::unexpected(std::move(list.error()));
  }
  sequence.color_list = sequence.depth_list = path;
  sequence.pairs = std::move(list->entries);
  take_notes(*list, sequence);
  return {};
}

}  // namespace

std::vector<TumAssociation> pair_by_stamp(const std::vector<TumListEntry>& color, const std::vector<TumListEntry>& depth,
                                          std::int64_t max_difference_ns) {
  return GreedyPairing(color, depth, max_difference_ns).run();
}

Result<TumSequence> load_tum_sequence(const ReplayConfig& config) {
  TumSequence sequence;
  sequence.folder = config.sequence;
  std::error_code ignored;
  if (!fs::is_directory(sequence.folder, ignored)) {
    return make_error(ErrorCode::NotFound, fmt::format("replay sequence '{}' is not a folder", config.sequence));
  }
  const Status loaded = config.associations.empty() ? load_lists(config.max_stamp_difference_s, sequence)
                                                    : load_associations(config.associations, sequence);
  if (!loaded) {
    return tl::unexpected(loaded.error());
  }
  sequence.period_ns = median_interval(sequence.pairs);
  return sequence;
}

}  // namespace posed
