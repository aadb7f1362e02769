#include "beam_needs.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace glass_nav {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kMaxTurn = 0.5;  // [rad] of a beam's end, seen from the pose: with more all is cast
constexpr double kStair = 1.0;    // cells that a slanted wall is off its line

/// Where beams end that are of the surface along one of them, as poses nearby see it.
struct Ends {
  double nearest, farthest;  // empty where there is no surface
  double surface;            // how far the farthest pose sees it
};

/// How far across a surface another pose may see it elsewhere; an error of the mirror's place counts twice.
double off(std::size_t path, const PoseSpread& spread) {
  return kStair + (path == kMirrored ? 3.0 : 1.0) * spread.cells;
}

Ends ends_at(const SeenSurfaces& seen, std::size_t path, std::size_t beam, const PoseSpread& spread,
             const EndGate& gate) {
  const SeenSurface& surface = seen.at[path][beam];
  if (!std::isfinite(surface.range)) return {kInfinite, -kInfinite, 0.0};
  const double cos = std::max(surface.cos, kMinCos), moved = off(path, spread);
  const double mirror = path == kMirrored ? 2.0 * seen.at[kFirst][beam].thickness : 0.0;
  const double depth = gate.depth_share * (surface.thickness + mirror);
  return {surface.range - (gate.across + moved) / cos, surface.range + (gate.across + moved + depth) / cos,
          surface.range + moved / cos};
}

/// What lies along the beams beside each beam of a scan.
class Neighbourhoods {
 public:
  Neighbourhoods(const SeenSurfaces& seen, const PoseSpread& spread, const EndGate& gate)
      : seen_(seen), spread_(spread) {
    for (std::size_t path = 0; path < kPathCount; ++path) {
      ends_[path].reserve(seen.beams);
      for (std::size_t b = 0; b < seen.beams; ++b) ends_[path].push_back(ends_at(seen, path, b, spread, gate));
    }
  }

  BeamNeed need(std::size_t beam, BeamEnd& end) const {
    const double turn = 2.0 * spread_.cells / std::min(seen_.at[kFirst][beam].range, end.range) + spread_.yaw_rad;
    std::size_t from = beam, to = beam;
    if (!(turn <= kMaxTurn) || !find(turn, from, to)) return {};  // nothing can be left out
    double reach = 0.0;
    for (std::size_t b = from; b <= to; ++b) reach = std::max(reach, ends_[kFirst][b].surface);
    std::array<bool, kPathCount> may_end{};
    for (const std::size_t path : {kMirrored, kSecond, kThird}) {
      for (std::size_t b = from; b <= to; ++b) {
        const Ends& ends = ends_[path][b];
        if (!(end.range >= ends.nearest && end.range <= ends.farthest)) continue;
        may_end[path] = true;
        reach = std::max(reach, ends.surface);
      }
    }
    end.reach = std::min(end.reach, reach);
    return {{may_end[kThird] ? 3 : may_end[kSecond] ? 2 : 1, may_end[kMirrored]}, {from, to}, true};
  }

 private:
  /// The beams up to a turn to either side; false where the scan ends before.
  bool find(double turn, std::size_t& from, std::size_t& to) const {
    const double *angles = seen_.angles, here = angles[from];
    for (; std::abs(angles[from] - here) < turn; --from) {
      if (from == 0) return false;
    }
    for (; std::abs(angles[to] - here) < turn; ++to) {
      if (to + 1 == seen_.beams) return false;
    }
    return true;
  }

  const SeenSurfaces& seen_;
  const PoseSpread& spread_;
  std::array<std::vector<Ends>, kPathCount> ends_;
};

}  // namespace

std::vector<BeamNeed> needs_of(const SeenSurfaces& seen, const PoseSpread& spread, const EndGate& gate,
                               std::vector<BeamEnd>& ends) {
  std::vector<BeamNeed> needs(seen.beams, BeamNeed{{0, false}, {}, false});
  const Neighbourhoods neighbourhoods(seen, spread, gate);
  for (std::size_t b = 0; b < seen.beams; ++b) {
    if (std::isfinite(ends[b].range)) needs[b] = neighbourhoods.need(b, ends[b]);
  }
  return needs;
}

}  // namespace glass_nav
