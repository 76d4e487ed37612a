#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "config/config.h"
#include "core/clock.h"
#include "core/result.h"
#include "drivers/tum_list.h"

namespace posed {

/// A recording in the TUM RGB-D layout: which colour image goes with which depth image, and when. Plain data.
struct TumSequence {
  std::filesystem::path folder;      ///< image names are relative to it
  std::filesystem::path color_list;  ///< file that names the colour images
  std::filesystem::path depth_list;
  std::vector<TumAssociation> pairs;  ///< ordered by colour stamp
  std::size_t unpaired = 0;           ///< colour images without depth within the permitted difference
  std::vector<Error> skipped_lines;   ///< lines of the lists that were left out, each with file and line
  std::vector<std::string> warnings;  ///< what is odd but loses nothing
  TimeNs period_ns = 0;               ///< median interval of colour stamps; 1/30 s where there is but one pair
};

/// Pairs each colour image with the depth image nearest in time, |difference| <= `max_difference_ns`; of two equally near ones the
/// earlier. A depth image may serve two colour images: where both cameras run at one rate but their phases drift, giving each depth
/// image away only once (as TUM's associate.py does) would leave out colour images that have good depth. Both lists ordered by
/// stamp. The pairs come ordered by colour stamp. O(n). Reentrant.
std::vector<TumAssociation> pair_by_stamp(const std::vector<TumListEntry>& color, const std::vector<TumListEntry>& depth,
                                          std::int64_t max_difference_ns);

/// Reads the lists that `config` names: rgb.txt and depth.txt of the folder `config.sequence`, or `config.associations` (a relative
/// name is looked for in the sequence's folder, then in the working folder), whose pairs are taken as they stand. No image is
/// opened. Errors: NotFound (folder or list, saying what was looked for), BadData (an empty list, no pair), Io. Reentrant.
Result<TumSequence> load_tum_sequence(const ReplayConfig& config);

}  // namespace posed
