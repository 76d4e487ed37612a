#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "slam/features.h"
#include "slam/keyframe_record.h"

namespace posed {

/// A keyframe that may show what the query shows.
struct PlaceCandidate {
  KeyframeId keyframe = kNoKeyframe;
  /// In [0, 1]: which share of the query's descriptors the keyframe has, each weighted by how rare it is in the index and by how
  /// well it agrees. 1 is the keyframe's own descriptors asked for in an index of their own.
  double score = 0;

  bool operator==(const PlaceCandidate&) const = default;
};

/// Finds keyframes that look like a query, by an inverted index of binary descriptors that needs no trained vocabulary: locality
/// sensitive hashing by bit sampling (Gionis, Indyk, Motwani, "Similarity search in high dimensions via hashing", VLDB 1999) with
/// every bucket one bit away probed too (Lv et al., "Multi-probe LSH", VLDB 2007). A posting carries 64 further bits of its
/// descriptor, which tell true neighbours from those that merely share the bucket (Jegou, Douze, Schmid, "Hamming embedding and
/// weak geometric consistency for large scale image search", ECCV 2008). Each query descriptor gives each keyframe one vote,
/// weighted by closeness and by the logarithm of how few keyframes it reaches (Sivic, Zisserman, "Video Google", ICCV 2003).
///
/// Results depend on what is in the index alone, not on the order in which it came: votes are integers, ties go to the smaller id.
/// Thread-bound.
///
/// Memory: about 22 bytes a descriptor and at most `kMaxDescriptors` of them a keyframe, 11 kB; what is removed is used again. The
/// table of buckets takes 1 MiB from the start, and up to 16 MiB go to chunks that are not full while the index is small.
class PlaceRecognizer {
 public:
  static constexpr std::size_t kMaxDescriptors = 500;  ///< indexed of each keyframe; of more, an even choice

  PlaceRecognizer();

  /// Puts a keyframe in; one that is in already is replaced.
  void add(KeyframeId keyframe, std::span<const Descriptor> descriptors);

  /// Takes it out; nothing happens where it is not in.
  void remove(KeyframeId keyframe);

  void clear();

  std::size_t size() const { return slot_of_.size(); }  ///< keyframes

  /// Memory held [bytes], capacity that waits for reuse included.
  std::size_t memory_bytes() const;

  /// Replaces `candidates` by at most `max_candidates` keyframes for which `eligible` holds, best first. Keyframes that share
  /// nothing with the query are never among them.
  void query(std::span<const Descriptor> descriptors, std::size_t max_candidates, const std::function<bool(KeyframeId)>& eligible,
             std::vector<PlaceCandidate>& candidates) const;

 private:
  static constexpr std::size_t kKeyBits = 18;
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  /// Postings of one bucket, a cache line's worth of them; only the first chunk of a bucket may have free places, at its end.
  struct alignas(64) Chunk {
    static constexpr std::size_t kPostings = 5;
    std::array<std::uint64_t, kPostings> signatures;
    std::array<std::uint32_t, kPostings> slots;  // kNone: free
    std::uint32_t next;                          // chunk or kNone
  };
  static_assert(sizeof(Chunk) == 64);

  struct Slot {
    KeyframeId keyframe = kNoKeyframe;
    std::vector<std::uint32_t> keys;  // of the descriptors indexed, to find the postings again
  };

  struct Tally;

  Chunk& chunk(std::uint32_t index) { return chunk_blocks_[index / kBlock][index % kBlock]; }
  const Chunk& chunk(std::uint32_t index) const { return chunk_blocks_[index / kBlock][index % kBlock]; }
  std::uint32_t take_chunk();
  void insert(std::uint32_t key, std::uint32_t slot, std::uint64_t signature);
  void erase(std::uint32_t key, std::uint32_t slot);
  void collect(const Descriptor& descriptor, Tally& tally) const;

  static constexpr std::uint32_t kBlock = 4096;  // chunks: growing copies nothing
  std::vector<std::uint32_t> first_chunk_;       // by key
  std::vector<std::unique_ptr<Chunk[]>> chunk_blocks_;
  std::uint32_t free_chunk_ = kNone;
  std::vector<Slot> slots_;
  std::vector<std::uint32_t> free_slots_;
  std::unordered_map<KeyframeId, std::uint32_t> slot_of_;  // looked up, never walked
};

}  // namespace posed
