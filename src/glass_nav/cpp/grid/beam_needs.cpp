#include "beam_needs.hpp"

#include <algorithm>
#include <cmath>

namespace glass_nav {
namespace {

constexpr double kMaxTurn = 0.15;  // [rad] of a beam's end, seen from the pose: with more all is cast
constexpr double kStair = 1.0;     // cells that a slanted wall is off its line

/// A beam and those beside it.
class Neighbours {
 public:
  Neighbours(const SeenSurfaces& seen, const PoseSpread& spread, const BeamEnd& end, std::size_t beam)
      : seen_(seen), spread_(spread), end_(end), beam_(beam) {
    const double nearest = std::min(seen.at[kFirst][beam].range, end.range);
    const double turn = 2.0 * spread.cells / nearest + spread.yaw_rad;
    known_ = turn <= kMaxTurn && find(turn);
  }

  /// Whether they are seen, as far as it matters; else nothing can be left out.
  bool known() const { return known_; }

  Need need() const {
    for (const std::size_t path : {kMirrored, kSecond, kThird}) {
      for (std::size_t b = from_; b <= to_; ++b) {
        if (may_end(path, b)) return Need::all;
      }
    }
    return Need::first;
  }

  double reach() const {
    double reach = 0.0;
    for (std::size_t path = 0; path < kPathCount; ++path) {
      for (std::size_t b = from_; b <= to_; ++b) {
        const SeenSurface& surface = seen_.at[path][b];
        if (!std::isfinite(surface.range) || (path != kFirst && !may_end(path, b))) continue;
        reach = std::max(reach, surface.range + off(path) / std::max(surface.cos, kMinCos));
      }
    }
    return reach;
  }

 private:
  /// The beams up to a turn to either side; false where the scan ends before.
  bool find(double turn) {
    const double* angles = seen_.angles;
    for (from_ = beam_; std::abs(angles[from_] - angles[beam_]) < turn; --from_) {
      if (from_ == 0) return false;
    }
    for (to_ = beam_; std::abs(angles[to_] - angles[beam_]) < turn; ++to_) {
      if (to_ + 1 == seen_.beams) return false;
    }
    return true;
  }

  /// The surface at the end of a path along another beam, and so one near it, may have ended this beam.
  bool may_end(std::size_t path, std::size_t beam) const {
    const SeenSurface& surface = seen_.at[path][beam];
    if (!std::isfinite(surface.range)) return false;
    const double across = (end_.range - surface.range) * std::max(surface.cos, kMinCos);
    const double mirror = path == kMirrored ? 2.0 * seen_.at[kFirst][beam].thickness : 0.0;
    const double depth = end_.depth_share * (surface.thickness + mirror);
    return across >= -end_.gate - off(path) && across <= end_.gate + off(path) + depth;
  }

  /// How far across a surface another pose may see it elsewhere; an error of the mirror's place counts twice.
  double off(std::size_t path) const { return kStair + (path == kMirrored ? 3.0 : 1.0) * spread_.cells; }

  const SeenSurfaces& seen_;
  const PoseSpread& spread_;
  const BeamEnd& end_;
  std::size_t beam_, from_ = 0, to_ = 0;
  bool known_ = false;
};

}  // namespace

std::vector<Need> needs_of(const SeenSurfaces& seen, const PoseSpread& spread, std::vector<BeamEnd>& ends) {
  std::vector<Need> needs(seen.beams, Need::all);
  for (std::size_t b = 0; b < seen.beams; ++b) {
    if (!std::isfinite(ends[b].range)) {
      needs[b] = Need::nothing;
      continue;
    }
    const Neighbours neighbours(seen, spread, ends[b], b);
    if (!neighbours.known()) continue;
    needs[b] = neighbours.need();
    ends[b].reach = std::min(ends[b].reach, neighbours.reach());
  }
  return needs;
}

}  // namespace glass_nav
