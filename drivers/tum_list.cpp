#include "drivers/tum_list.h"

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "core/clock.h"

namespace posed {

namespace {

constexpr std::string_view kSeparators = " \t,\r";
constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
constexpr std::size_t kMaxQuoted = 60;

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

/// Text of a file as it may stand in a message: short, and without control characters.
std::string quoted(std::string_view text) {
  std::string shown(text.substr(0, kMaxQuoted));
  std::replace_if(
      shown.begin(), shown.end(), [](char c) { return static_cast<unsigned char>(c) < ' ' || c == 0x7f; }, '?');
  return fmt::format("'{}{}'", shown, text.size() > kMaxQuoted ? "..." : "");
}

/// Fields of a line into `fields`; how many there are, which may be more than fit.
template <std::size_t N>
std::size_t split(std::string_view line, std::array<std::string_view, N>& fields) {
  std::size_t count = 0;
  std::size_t begin = line.find_first_not_of(kSeparators);
  while (begin != std::string_view::npos) {
    const std::size_t end = std::min(line.find_first_of(kSeparators, begin), line.size());
    if (count < N) {
      fields[count] = line.substr(begin, end - begin);
    }
    ++count;
    begin = line.find_first_not_of(kSeparators, end);
  }
  return count;
}

/// Calls `consume(line, number)` for each line that says something.
template <typename Consume>
void for_each_line(std::string_view text, Consume&& consume) {
  if (text.starts_with(kByteOrderMark)) {
    text.remove_prefix(kByteOrderMark.size());
  }
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    const std::size_t begin = line.find_first_not_of(kSeparators);
    if (begin != std::string_view::npos && line[begin] != '#') {
      consume(line, number);
    }
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

Result<TumListEntry> parse_entry(std::string_view stamp, std::string_view image, int line) {
  const Result<std::int64_t> stamp_ns = parse_stamp(stamp);
  if (!stamp_ns) {
    return tl::unexpected(stamp_ns.error());
  }
  if (image.find('\0') != std::string_view::npos) {
    return make_error(ErrorCode::BadData, "a zero byte in the image's name");
  }
  return TumListEntry{*stamp_ns, std::string(image), line};
}

Result<TumListEntry> parse_list_line(std::string_view line, int number) {
  std::array<std::string_view, 2> fields;
  if (const std::size_t count = split(line, fields); count != fields.size()) {
    return make_error(ErrorCode::BadData, fmt::format("{} fields where 'stamp image' is expected: {}", count, quoted(line)));
  }
  return parse_entry(fields[0], fields[1], number);
}

bool lies_in_depth_folder(std::string_view image) {
  const std::filesystem::path folder = std::filesystem::path(image).parent_path();
  return std::find(folder.begin(), folder.end(), "depth") != folder.end();
}

Result<TumAssociation> parse_association_line(std::string_view line, int number) {
  std::array<std::string_view, 4> fields;
  if (const std::size_t count = split(line, fields); count != fields.size()) {
    return make_error(ErrorCode::BadData,
                      fmt::format("{} fields where 'stamp image stamp image' is expected: {}", count, quoted(line)));
  }
  Result<TumListEntry> first = parse_entry(fields[0], fields[1], number);
  if (!first) {
    return tl::unexpected(std::move(first.error()));
  }
  Result<TumListEntry> second = parse_entry(fields[2], fields[3], number);
  if (!second) {
    return tl::unexpected(std::move(second.error()));
  }
  if (lies_in_depth_folder(first->image) && !lies_in_depth_folder(second->image)) {
    std::swap(*first, *second);
  }
  return TumAssociation{std::move(*first), std::move(*second)};
}

const TumListEntry& key(const TumListEntry& entry) {
  return entry;
}
const TumListEntry& key(const TumAssociation& association) {
  return association.color;
}

/// What both kinds of file have in common; List is TumList or TumAssociationList.
template <typename List, typename ParseLine>
Result<List> parse_list(std::string_view text, const std::filesystem::path& name, ParseLine&& parse_line) {
  List list;
  std::map<std::int64_t, int> line_of_stamp;
  std::int64_t latest_ns = std::numeric_limits<std::int64_t>::min();
  std::size_t skipped = 0;
  const auto skip = [&](int number, const std::string& reason) {
    if (++skipped <= kMaxSkippedLines) {
      list.skipped_lines.push_back({ErrorCode::BadData, fmt::format("{}:{}: {}", name.string(), number, reason)});
    }
  };
  for_each_line(text, [&](std::string_view line, int number) {
    auto entry = parse_line(line, number);
    if (!entry) {
      skip(number, entry.error().message);
      return;
    }
    const std::int64_t stamp_ns = key(*entry).stamp_ns;
    const auto [known, is_new] = line_of_stamp.try_emplace(stamp_ns, number);
    if (!is_new) {
      skip(number, fmt::format("stamp {} stands already in line {}; this line is left out", format_stamp(stamp_ns), known->second));
      return;
    }
    if (stamp_ns < latest_ns && list.unsorted.empty()) {
      list.unsorted =
          fmt::format("{}:{}: stamp {} is earlier than that of a line before; the list is used in the order of the stamps",
                      name.string(), number, format_stamp(stamp_ns));
    }
    latest_ns = std::max(latest_ns, stamp_ns);
    list.entries.push_back(std::move(*entry));
  });

  if (skipped > kMaxSkippedLines) {
    return make_error(ErrorCode::BadData, fmt::format("{}: {} malformed or repeated lines, the first: {}", name.string(), skipped,
                                                      list.skipped_lines.front().message));
  }
  if (list.entries.empty()) {
    return make_error(ErrorCode::BadData,
                      fmt::format("{}: the list names no image{}", name.string(),
                                  skipped == 0 ? "" : "; first bad line: " + list.skipped_lines.front().message));
  }
  std::sort(list.entries.begin(), list.entries.end(),
            [](const auto& a, const auto& b) { return key(a).stamp_ns < key(b).stamp_ns; });
  return list;
}

}  // namespace

Result<std::int64_t> parse_stamp(std::string_view seconds) {
  constexpr int kDecimals = 9;
  constexpr std::int64_t kMaxSeconds = std::numeric_limits<std::int64_t>::max() / kNsPerSecond - 1;
  const auto malformed = [&] {
    return make_error(ErrorCode::BadData,
                      fmt::format("stamp {} is not a number of seconds such as 1305031102.175304", quoted(seconds)));
  };

  const std::size_t point = std::min(seconds.find('.'), seconds.size());
  const std::string_view whole = seconds.substr(0, point);
  const std::string_view fraction = seconds.substr(std::min(point + 1, seconds.size()));
  if (whole.empty() || !std::all_of(whole.begin(), whole.end(), is_digit) ||
      !std::all_of(fraction.begin(), fraction.end(), is_digit)) {
    return malformed();
  }
  std::int64_t value = 0;
  for (const char c : whole) {
    value = 10 * value + (c - '0');
    if (value > kMaxSeconds) {
      return make_error(ErrorCode::BadData, fmt::format("stamp {} is larger than {} seconds", quoted(seconds), kMaxSeconds));
    }
  }
  for (std::size_t i = 0; i < kDecimals; ++i) {
    value = 10 * value + (i < fraction.size() ? fraction[i] - '0' : 0);
  }
  const bool round_up = fraction.size() > kDecimals && fraction[kDecimals] >= '5';
  return value + (round_up ? 1 : 0);
}

std::string format_stamp(std::int64_t stamp_ns) {
  return fmt::format("{}.{:09}", stamp_ns / kNsPerSecond, stamp_ns % kNsPerSecond);
}

Result<TumList> parse_tum_list(std::string_view text, const std::filesystem::path& name) {
  return parse_list<TumList>(text, name, parse_list_line);
}

Result<TumAssociationList> parse_tum_associations(std::string_view text, const std::filesystem::path& name) {
  return parse_list<TumAssociationList>(text, name, parse_association_line);
}

}  // namespace posed
