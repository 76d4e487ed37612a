#include "slam/free_space.h"

#include <algorithm>
#include <cmath>

namespace posed {

namespace {

constexpr std::int64_t kReferencePeriod_ns = 300 * kNsPerMs;
constexpr std::int64_t kStaticAge_ns = 800 * kNsPerMs;  // whoever stands still for less is not furniture
constexpr int kLeastAround = 6;                         // valid cells of nine that a line of sight takes to be called free

}  // namespace

FreeSpace::FreeSpace(const PinholeCamera& camera)
    : camera_(camera),
      references_(kReferences, Reference{DepthGrid(camera.intrinsics().width, camera.intrinsics().height), {}, Se3(), 0}) {
  for (Reference& reference : references_) {
    reference.is_mover.assign(reference.depth.size(), 0);
  }
}

void FreeSpace::judge(const DepthGrid& now, const Se3& T_odom_camera, std::int64_t stamp_ns,
                      std::vector<CellEvidence>& evidence) const {
  evidence.assign(now.size(), CellEvidence::Unknown);
  for (std::size_t i = 0; i < count_; ++i) {
    const Reference& reference = references_[i];
    const bool long_ago = stamp_ns - reference.stamp_ns >= kStaticAge_ns;
    compare(now, reference, reference.T_odom_camera.inverse() * T_odom_camera,
            long_ago ? CellEvidence::Static : CellEvidence::Still, evidence);
  }
}

void FreeSpace::compare(const DepthGrid& now, const Reference& reference, const Se3& T_reference_now, CellEvidence if_met,
                        std::vector<CellEvidence>& evidence) const {
  const Eigen::Matrix3f R = T_reference_now.rotation_matrix().cast<float>();
  const Eigen::Vector3f t = T_reference_now.translation().cast<float>();
  for (std::size_t cell = 0; cell < now.size(); ++cell) {
    if (now[cell] <= 0 || evidence[cell] == CellEvidence::Moved) {
      continue;
    }
    const Eigen::Vector3f p = R * camera_.point(cell, now[cell]) + t;
    const int there = camera_.cell_of(p);
    if (there == GridCamera::kOutside) {
      continue;
    }
    const auto middle = static_cast<std::size_t>(there);
    const float tolerance = depth_tolerance_m(p.z());
    int valid = 0;
    bool free = true;
    bool met = false;
    bool met_mover = false;
    const auto look = [&](std::size_t c) {
      const float z = reference.depth[c];
      if (z <= 0) {
        return;
      }
      ++valid;
      free = free && z > p.z() + tolerance;
      const bool here = std::abs(z - p.z()) < tolerance;
      met = met || (here && reference.is_mover[c] == 0);
      met_mover = met_mover || (here && reference.is_mover[c] != 0);
    };
    look(middle);
    now.for_each_around(middle, look);
    if (free && valid >= kLeastAround) {
      evidence[cell] = CellEvidence::Moved;
    } else if (met) {
      evidence[cell] = std::max(evidence[cell], if_met);
    } else if (met_mover && if_met == CellEvidence::Static) {
      evidence[cell] = std::max(evidence[cell], CellEvidence::Resting);
    }
  }
}

void FreeSpace::remember(const DepthGrid& now, std::span<const std::uint8_t> is_mover, const Se3& T_odom_camera,
                         std::int64_t stamp_ns) {
  const std::size_t last = (next_ + kReferences - 1) % kReferences;
  if (count_ > 0 && stamp_ns >= references_[last].stamp_ns && stamp_ns - references_[last].stamp_ns < kReferencePeriod_ns) {
    return;
  }
  Reference& reference = references_[next_];
  reference.depth = now;
  std::copy(is_mover.begin(), is_mover.end(), reference.is_mover.begin());
  reference.T_odom_camera = T_odom_camera;
  reference.stamp_ns = stamp_ns;
  next_ = (next_ + 1) % kReferences;
  count_ = std::min(count_ + 1, kReferences);
}

}  // namespace posed
