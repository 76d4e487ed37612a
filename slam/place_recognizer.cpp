#include "slam/place_recognizer.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace posed {

namespace {

constexpr int kMaxSignatureDistance = 14;  // bits of 64
constexpr std::uint32_t kRarityOne = 1024;

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

PlaceRecognizer::PlaceRecognizer() : first_chunk_(kTables * kBuckets, kNone) {}

PlaceRecognizer::Keys PlaceRecognizer::keys_of(const Descriptor& descriptor) {
  Keys keys{};
  for (std::size_t t = 0; t < kTables; ++t) {
    keys[t] = static_cast<std::uint16_t>(descriptor[0] >> (kKeyBits * t));
  }
  return keys;
}

void PlaceRecognizer::insert(std::size_t bucket, std::uint32_t slot, std::uint64_t signature) {
  std::uint32_t& first = first_chunk_[bucket];
  if (first == kNone || chunks_[first].slots.back() != kNone) {
    std::uint32_t fresh = free_chunk_;
    if (fresh == kNone) {
      fresh = static_cast<std::uint32_t>(chunks_.size());
      chunks_.emplace_back();
    } else {
      free_chunk_ = chunks_[fresh].next;
    }
    chunks_[fresh].slots.fill(kNone);
    chunks_[fresh].next = first;
    first = fresh;
  }
  Chunk& chunk = chunks_[first];
  const auto place = static_cast<std::size_t>(std::find(chunk.slots.begin(), chunk.slots.end(), kNone) - chunk.slots.begin());
  chunk.slots[place] = slot;
  chunk.signatures[place] = signature;
}

void PlaceRecognizer::erase(std::size_t bucket, std::uint32_t slot) {
  std::uint32_t& first = first_chunk_[bucket];
  std::uint32_t holder = first;
  std::size_t place = 0;
  for (; holder != kNone; holder = chunks_[holder].next) {
    const auto& slots = chunks_[holder].slots;
    place = static_cast<std::size_t>(std::find(slots.begin(), slots.end(), slot) - slots.begin());
    if (place < Chunk::kPostings) {
      break;
    }
  }
  // The first chunk's last posting fills the gap.
  Chunk& front = chunks_[first];
  const auto used = static_cast<std::size_t>(std::find(front.slots.begin(), front.slots.end(), kNone) - front.slots.begin());
  chunks_[holder].slots[place] = front.slots[used - 1];
  chunks_[holder].signatures[place] = front.signatures[used - 1];
  front.slots[used - 1] = kNone;
  if (used == 1) {
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
    slot.keys.push_back(keys_of(d));
    for (std::size_t t = 0; t < kTables; ++t) {
      insert(bucket(t, slot.keys.back()[t]), s, signature_of(d));
    }
  }
}

void PlaceRecognizer::remove(KeyframeId keyframe) {
  const auto found = slot_of_.find(keyframe);
  if (found == slot_of_.end()) {
    return;
  }
  Slot& slot = slots_[found->second];
  for (const Keys& keys : slot.keys) {
    for (std::size_t t = 0; t < kTables; ++t) {
      erase(bucket(t, keys[t]), found->second);
    }
  }
  free_slots_.push_back(found->second);
  slot = {};
  slot_of_.erase(found);
}

void PlaceRecognizer::clear() {
  *this = PlaceRecognizer();
}

std::size_t PlaceRecognizer::memory_bytes() const {
  std::size_t bytes = first_chunk_.capacity() * sizeof(std::uint32_t) + chunks_.capacity() * sizeof(Chunk) +
                      slots_.capacity() * sizeof(Slot) + free_slots_.capacity() * sizeof(std::uint32_t);
  for (const Slot& slot : slots_) {
    bytes += slot.keys.capacity() * sizeof(Keys);
  }
  // A node and a bucket of the hash map.
  return bytes + slot_of_.size() * (sizeof(std::pair<KeyframeId, std::uint32_t>) + 2 * sizeof(void*));
}

void PlaceRecognizer::collect(const Descriptor& descriptor, Tally& tally) const {
  // Buckets are scattered over the memory: their chains are followed side by side, each next chunk fetched while the others' are
  // read.
  std::array<std::uint32_t, kProbes> chains;
  std::size_t open = 0;
  const auto follow = [&](std::size_t chain, std::uint32_t chunk) {
    chains[chain] = chunk;
    __builtin_prefetch(&chunks_[chunk]);
  };
  const Keys keys = keys_of(descriptor);
  for (std::size_t t = 0; t < kTables; ++t) {
    for (std::size_t probe = 0; probe <= kKeyBits; ++probe) {
      const std::size_t key = probe < kKeyBits ? keys[t] ^ (std::size_t{1} << probe) : keys[t];
      if (const std::uint32_t first = first_chunk_[bucket(t, key)]; first != kNone) {
        follow(open++, first);
      }
    }
  }
  const std::uint64_t signature = signature_of(descriptor);
  while (open > 0) {
    for (std::size_t c = 0; c < open;) {
      const Chunk& chunk = chunks_[chains[c]];
      for (std::size_t i = 0; i < Chunk::kPostings; ++i) {
        const int distance = std::popcount(chunk.signatures[i] ^ signature);
        const std::uint32_t slot = chunk.slots[i];
        if (distance > kMaxSignatureDistance || slot == kNone) {
          continue;
        }
        std::uint8_t& nearest = tally.nearest[slot];
        if (nearest == Tally::kUnreached) {
          tally.reached.push_back(slot);
        }
        nearest = std::min(nearest, static_cast<std::uint8_t>(distance));
      }
      if (chunk.next != kNone) {
        follow(c++, chunk.next);
      } else {
        chains[c] = chains[--open];
      }
    }
  }
}

void PlaceRecognizer::query(std::span<const Descriptor> descriptors, std::size_t max_candidates,
                            const std::function<bool(KeyframeId)>& eligible, std::vector<PlaceCandidate>& candidates) const {
  candidates.clear();
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
