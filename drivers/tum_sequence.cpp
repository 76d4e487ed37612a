#include "drivers/tum_sequence.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "core/file_io.h"

namespace posed {

namespace {

namespace fs = std::filesystem;

constexpr TimeNs kPeriodOfSingleFrameNs = kNsPerSecond / 30;

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
  std::vector<TumAssociation> pairs;
  auto nearest = depth.begin();
  for (const TumListEntry& entry : color) {
    const auto distance_ns = [&](auto candidate) { return std::abs(candidate->stamp_ns - entry.stamp_ns); };
    // Both lists are ordered, so the nearest depth image never moves back.
    while (nearest != depth.end() && std::next(nearest) != depth.end() && distance_ns(std::next(nearest)) < distance_ns(nearest)) {
      ++nearest;
    }
    if (nearest != depth.end() && distance_ns(nearest) <= max_difference_ns) {
      pairs.push_back({entry, *nearest});
    }
  }
  return pairs;
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
