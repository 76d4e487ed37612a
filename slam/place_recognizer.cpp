#include "slam/place_recognizer.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

namespace posed {

namespace {

constexpr int kMaxSignatureDistance = 14;  // bits of 64
constexpr std::uint32_t kRarityOne = 1024;

/// The descriptor's bits that make up the key. Chosen among all 256 one by one: even odds, few flips between views of the same
/// point, and little correlation with those before. Neighbouring bits are too much alike: sixteen in a row meet in one bucket of
/// 2^-8 to 2^-9 of all pairs of descriptors, these eighteen in one of 2^-14 to 2^-15.
constexpr std::array<std::uint8_t, 18> kKeyBitsOf = {3,  46,  58,  86,  133, 41,  164, 182, 221,
                                                     22, 130, 170, 237, 125, 124, 206, 250, 7};

std::uint32_t key_of(const Descriptor& descriptor) {
  std::uint32_t key = 0;
  for (const std::size_t bit : kKeyBitsOf) {
    key = key << 1 | static_cast<std::uint32_t>((descriptor[bit / 64] >> (bit % 64)) & 1U);
  }
  return key;
}

/// Few of its bits are in the key.
std::uint64_t signature_of(const Descriptor& descriptor) {
  return descriptor[2];
}

/// Weight of a match whose signatures differ in `distance` bits.
std::uint32_t closeness(int distance) {
  return static_cast<std::uint32_t>(kMaxSignatureDistance + 1 - distance);
}
constexpr std::uint32_t kBestCloseness = kMaxSignatureDistance + 1;

}  // namespace

/// What a query has counted so far; entry i of the vectors is slot i.
struct PlaceRecognizer::Tally {
  explicit Tally(std::size_t slots) : nearest(slots, kUnreached), votes(slots, 0) {}

  static constexpr std::uint8_t kUnreached = 255;
  std::vector<std::uint8_t> nearest;   // signature distance to the present descriptor
  std::vector<std::uint32_t> reached;  // slots with an entry in `nearest`
  std::vector<std::uint32_t> votes;
  std::uint64_t possible_votes = 0;
};

PlaceRecognizer::PlaceRecognizer() : first_chunk_(std::size_t{1} << kKeyBits, kNone) {
  static_assert(kKeyBitsOf.size() == kKeyBits);
}

std::uint32_t PlaceRecognizer::take_chunk() {
  if (free_chunk_ == kNone) {
    const auto begin = static_cast<std::uint32_t>(chunk_blocks_.size()) * kBlock;
    chunk_blocks_.push_back(std::make_unique<Chunk[]>(kBlock));
    for (std::uint32_t i = 0; i < kBlock; ++i) {
      chunk(begin + i).next = i + 1 < kBlock ? begin + i + 1 : kNone;
    }
    free_chunk_ = begin;
  }
  const std::uint32_t taken = free_chunk_;
  free_chunk_ = chunk(taken).next;
  return taken;
}

void PlaceRecognizer::insert(std::uint32_t key, std::uint32_t slot, std::uint64_t signature) {
  std::uint32_t& first = first_chunk_[key];
  if (first == kNone || chunk(first).slots.back() != kNone) {
    const std::uint32_t fresh = take_chunk();
    chunk(fresh).slots.fill(kNone);
    chunk(fresh).next = first;
    first = fresh;
  }
  Chunk& front = chunk(first);
  const auto place = static_cast<std::size_t>(std::find(front.slots.begin(), front.slots.end(), kNone) - front.slots.begin());
  front.slots[place] = slot;
  front.signatures[place] = signature;
}

void PlaceRecognizer::erase(std::uint32_t key, std::uint32_t slot) {
  std::uint32_t& first = first_chunk_[key];
  const auto place_in = [&](std::uint32_t c, std::uint32_t wanted) {
    const auto& slots = chunk(c).slots;
    return static_cast<std::size_t>(std::find(slots.begin(), slots.end(), wanted) - slots.begin());
  };
  std::uint32_t holder = first;
  std::size_t place = place_in(holder, slot);
  while (place == Chunk::kPostings) {
    holder = chunk(holder).next;
    assert(holder != kNone);
    place = place_in(holder, slot);
  }
  // The first chunk's last posting fills the gap.
  Chunk& front = chunk(first);
  const std::size_t last = place_in(first, kNone) - 1;
  chunk(holder).slots[place] = front.slots[last];
  chunk(holder).signatures[place] = front.signatures[last];
  front.slots[last] = kNone;
  if (last == 0) {
    const std::uint32_t emptied = first;
    first = front.next;
    front.next = free_chunk_;
    free_chunk_ = emptied;
  }
}

void PlaceRecognizer::add(KeyframeId keyframe, std::span<const Descriptor> descriptors) {
  remove(keyframe);
  if (free_slots_.empty()) {
    free_slots_.push_back(static_cast<std::uint32_t>(slots_.size()));
    slots_.emplace_back();
  }
  const std::uint32_t s = free_slots_.back();
  free_slots_.pop_back();
  slot_of_.emplace(keyframe, s);
  Slot& slot = slots_[s];
  slot.keyframe = keyframe;
  const std::size_t count = std::min(descriptors.size(), kMaxDescriptors);
  slot.keys.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Descriptor& d = descriptors[i * descriptors.size() / count];
    slot.keys.push_back(key_of(d));
    insert(slot.keys.back(), s, signature_of(d));
  }
}

void PlaceRecognizer::remove(KeyframeId keyframe) {
  const auto found = slot_of_.find(keyframe);
  if (found == slot_of_.end()) {
    return;
  }
  Slot& slot = slots_[found->second];
  for (const std::uint32_t key : slot.keys) {
    erase(key, found->second);
  }
  free_slots_.push_back(found->second);
  slot = {};
  slot_of_.erase(found);
}

void PlaceRecognizer::clear() {
  *this = PlaceRecognizer();
}

std::size_t PlaceRecognizer::memory_bytes() const {
  std::size_t bytes = first_chunk_.capacity() * sizeof(std::uint32_t) + chunk_blocks_.size() * kBlock * sizeof(Chunk) +
                      slots_.capacity() * sizeof(Slot) + free_slots_.capacity() * sizeof(std::uint32_t);
  for (const Slot& slot : slots_) {
    bytes += slot.keys.capacity() * sizeof(std::uint32_t);
  }
  // A node and a bucket of the hash map.
  return bytes + slot_of_.size() * (sizeof(std::pair<KeyframeId, std::uint32_t>) + 2 * sizeof(void*));
}

void PlaceRecognizer::collect(const Descriptor& descriptor, Tally& tally) const {
  // Buckets are scattered over the memory: their chains are followed side by side, each next chunk fetched while the others' are
  // read.
  std::array<std::uint32_t, 1 + kKeyBits> chains;
  std::size_t open = 0;
  const auto follow = [&](std::size_t chain, std::uint32_t index) {
    chains[chain] = index;
    __builtin_prefetch(&chunk(index));
  };
  const std::uint32_t key = key_of(descriptor);
  for (std::size_t probe = 0; probe <= kKeyBits; ++probe) {
    const std::uint32_t flipped = probe < kKeyBits ? std::uint32_t{1} << probe : 0;
    if (const std::uint32_t first = first_chunk_[key ^ flipped]; first != kNone) {
      follow(open++, first);
    }
  }
  const std::uint64_t signature = signature_of(descriptor);
  while (open > 0) {
    for (std::size_t c = 0; c < open;) {
      const Chunk& postings = chunk(chains[c]);
      for (std::size_t i = 0; i < Chunk::kPostings; ++i) {
        const int distance = std::popcount(postings.signatures[i] ^ signature);
        const std::uint32_t slot = postings.slots[i];
        if (distance > kMaxSignatureDistance || slot == kNone) {
          continue;
        }
        std::uint8_t& nearest = tally.nearest[slot];
        if (nearest == Tally::kUnreached) {
          tally.reached.push_back(slot);
        }
        nearest = std::min(nearest, static_cast<std::uint8_t>(distance));
      }
      if (postings.next != kNone) {
        follow(c++, postings.next);
      } else {
        chains[c] = chains[--open];
      }
    }
  }
}

void PlaceRecognizer::query(std::span<const Descriptor> descriptors, std::size_t max_candidates,
                            const std::function<bool(KeyframeId)>& eligible, std::vector<PlaceCandidate>& candidates) const {
  candidates.clear();
  if (size() == 0) {
    return;
  }
  Tally tally(slots_.size());
  const double keyframes = static_cast<double>(size()) + 1.0;
  for (const Descriptor& d : descriptors) {
    collect(d, tally);
    const double reached = std::max(1.0, static_cast<double>(tally.reached.size()));
    const auto rarity = static_cast<std::uint32_t>(std::lround(kRarityOne * std::log(keyframes / reached) / std::log(keyframes)));
    for (const std::uint32_t slot : tally.reached) {
      tally.votes[slot] += rarity * closeness(tally.nearest[slot]);
      tally.nearest[slot] = Tally::kUnreached;
    }
    tally.reached.clear();
    tally.possible_votes += rarity * kBestCloseness;
  }
  for (std::size_t s = 0; s < slots_.size(); ++s) {
    if (tally.votes[s] > 0) {
      candidates.push_back({slots_[s].keyframe, static_cast<double>(tally.votes[s]) / static_cast<double>(tally.possible_votes)});
    }
  }
  std::sort(candidates.begin(), candidates.end(), [](const PlaceCandidate& a, const PlaceCandidate& b) {
    return a.score != b.score ? a.score > b.score : a.keyframe < b.keyframe;
  });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < candidates.size() && kept < max_candidates; ++i) {
    if (eligible(candidates[i].keyframe)) {
      candidates[kept++] = candidates[i];
    }
  }
  candidates.resize(kept);
}

}  // namespace posed
