#pragma once

#include <memory>

#include "config/config.h"
#include "core/clock.h"
#include "core/result.h"
#include "drivers/rgbd_source.h"

namespace posed {

/// Plays a recording in the TUM RGB-D layout (see tum_sequence.h for lists and pairing, image_file.h for what an image must be).
/// Frames are decoded ahead on a thread of their own.
///
/// - Realtime: the first pair is due as soon as it is decoded, every other by its stamp's distance from the first one's.
/// `capture_ns` is
///   that due time, even where decoding was late, so that latency is measured honestly. No free slot at the due time: NoFreeSlot.
/// - Lockstep: as fast as decoding goes, `capture_ns` is the time of delivery, and nothing is ever dropped.
///
/// `sequence` is the index of the pair, so what is skipped leaves a gap; `stamp_utc_ns` is the colour image's stamp. With `loop`
/// both keep growing: each pass is shifted by the recording's duration and one median period. Malformed and repeated lines of the
/// lists come first, as SkippedFrame captures; an image that is missing, truncated, corrupt or of a wrong kind is a SkippedFrame in
/// its place, named by list, line and path. Failed: a whole pass without one good frame.
///
/// Errors here: as `load_tum_sequence`; InvalidArgument where the size of the first readable colour image is not the calibration's;
/// the first image's error where no colour image is readable.
Result<std::unique_ptr<RgbdSource>> make_replay_source(const SourceConfig& config, const CameraIntrinsics& camera,
                                                       const Clock& clock);

}  // namespace posed
