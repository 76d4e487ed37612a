#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "config/config.h"
#include "core/image_view.h"
#include "slam/features.h"
#include "core/simd_level.h"

namespace posed {

/// ORB features: FAST-9 corners on an image pyramid, spread over the image by a quad-tree, oriented by the intensity centroid and
/// described by rotated BRIEF. Sources: Rublee et al., "ORB: an efficient alternative to SIFT or SURF", ICCV 2011; Rosten and
/// Drummond, "Machine learning for high-speed corner detection", ECCV 2006 (FAST); quad-tree distribution as described in
/// Mur-Artal, Montiel, Tardos, "ORB-SLAM", T-RO 2015, section III-B.
///
/// All buffers are allocated at construction: `extract` does not allocate once its output vectors have grown, takes no lock and
/// starts no thread. All arithmetic that decides anything is integer or of fixed order, so the result is the same on every
/// instruction set (the SIMD kernels are chosen at construction by what the processor offers). Reentrant: one extractor a thread.
class OrbExtractor {
 public:
  OrbExtractor(const TrackerConfig& config, int width, int height);
  /// With the kernels of one of `supported_simd_levels()`, for tests and benchmarks.
  OrbExtractor(const TrackerConfig& config, int width, int height, SimdLevel simd_level);
  ~OrbExtractor();
  OrbExtractor(OrbExtractor&&) noexcept;

  /// Replaces `features` by those of `gray`, whose size is that of construction; at most `config.features` (a few more where the
  /// quad-tree's last split gives them), ordered by level, then by position: a function of the pixels alone.
  /// Where `left_out` is given, one entry for each cell of kMaskCell x kMaskCell pixels row by row, there are none in cells whose
  /// entry is not 0, and as many more elsewhere.
  void extract(ImageView<const std::uint8_t> gray, Features& features, std::span<const std::uint8_t> left_out = {});

  static constexpr int kMaskCell = 8;  ///< [pixels]

 private:
  struct Workspace;
  std::unique_ptr<Workspace> workspace_;
};

}  // namespace posed
