#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"

/// The text lists of the TUM RGB-D layout (Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", 2012). Reentrant.
namespace posed {

/// One line that names an image. Stamps: nanoseconds since 1970 UTC, or whatever epoch the recording has.
struct TumListEntry {
  std::int64_t stamp_ns = 0;
  std::string image;  ///< relative to the sequence's folder
  int line = 0;       ///< counted from 1
};

/// `rgb.txt` or `depth.txt`, ordered by stamp, each stamp once.
struct TumList {
  std::vector<TumListEntry> entries;
  std::vector<Error> skipped_lines;  ///< malformed lines and stamps that came before, in the file's order, with file and line
  std::string unsorted;  ///< where the file's order was not that of the stamps: a message that names the first such line
};

/// One line of an associations file.
struct TumAssociation {
  TumListEntry color;
  TumListEntry depth;
};

/// An associations file, ordered by colour stamp, each colour stamp once.
struct TumAssociationList {
  std::vector<TumAssociation> entries;
  std::vector<Error> skipped_lines;
  std::string unsorted;
};

/// More skipped lines than this and the file is taken for something else altogether.
constexpr std::size_t kMaxSkippedLines = 1000;

/// Decimal seconds ("1305031102.175304"; digits with at most one point, no sign, no exponent) to nanoseconds, exactly: the text
/// never passes through a floating-point number. Digits after the ninth decimal are rounded half up. Error: BadData.
Result<std::int64_t> parse_stamp(std::string_view seconds);

/// The inverse of `parse_stamp`, always with nine decimals. `stamp_ns` >= 0.
std::string format_stamp(std::int64_t stamp_ns);

/// Lines "stamp image". Fields are separated by spaces, tabs or commas; lines may end in CR LF; empty lines and those that begin
/// with
/// '#' say nothing. A malformed line and a stamp that an earlier line has are skipped and noted. `name` stands for the file in
/// messages. Error BadData: no usable line, or more than `kMaxSkippedLines` skipped ones.
Result<TumList> parse_tum_list(std::string_view text, const std::filesystem::path& name);

/// Lines "stamp image stamp image", colour first; or depth first where the first image lies in a folder `depth` and the second does
/// not. Otherwise as `parse_tum_list`.
Result<TumAssociationList> parse_tum_associations(std::string_view text, const std::filesystem::path& name);

}  // namespace posed
