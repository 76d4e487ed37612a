#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "config/config.h"
#include "core/result.h"
#include "daemon/tracked_view.h"
#include "slam/orb_extractor.h"
#include "tools/posectl/color_image.h"

namespace posed {

/// Right and wrong decisions, where "positive" is a mover. Plain data.
struct MaskScore {
  std::uint64_t true_positive = 0;
  std::uint64_t false_positive = 0;
  std::uint64_t false_negative = 0;

  double recall() const;
  double precision() const;
  double intersection_over_union() const;
};

/// Looks at what the tracker masked: draws it, and compares it with true masks. Thread-bound to the tracking thread while the
/// pipeline runs; the first error is kept for `status`.
class MaskReport {
 public:
  struct Options {
    std::filesystem::path draw;   ///< folder for pictures: movers tinted, features kept (green) and left out (blue); empty: none
    int draw_every = 15;          ///< frames
    std::filesystem::path truth;  ///< folder of STAMP.png (to 6 or 9 decimals), not 0 where something moves; empty: none
  };

  MaskReport(Options options, const Config& config);

  void add(const TrackedView& view);

  const Status& status() const { return status_; }

  /// A few lines for people; empty without true masks.
  std::string summary() const;

 private:
  Status draw(const TrackedView& view);
  Status compare(const TrackedView& view);

  Options options_;
  OrbExtractor extractor_;
  Features features_;  // of the whole image
  ColorImage truth_;
  std::vector<std::uint8_t> picture_;
  MaskScore pixels_;
  MaskScore found_;  // by those features
  std::uint64_t kept_ = 0;
  std::uint64_t kept_on_movers_ = 0;
  std::uint64_t frames_ = 0;
  Status status_;
};

}  // namespace posed
