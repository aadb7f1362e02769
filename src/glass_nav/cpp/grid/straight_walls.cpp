#include "straight_walls.hpp"

#include <algorithm>
#include <cmath>

namespace glass_nav {
namespace {

constexpr double kOffLine = 1.0;         // cells: the steps of a staircase
constexpr double kSameDirection = 0.99;  // cosine between normals of one wall: 8 degrees
constexpr double kMostBehind = 2.0;      // cells between the end of a ray and the line
constexpr double kGrazing = 0.15;        // cosine of an incidence at which the steps of a wall matter too much

}  // namespace

StraightWalls::StraightWalls(const SeenSurfaces& seen, const std::array<const std::int32_t*, kPathCount>& cells,
                             const std::vector<Ray>& rays, int width)
    : seen_(seen), cells_(cells), width_(width) {
  for (std::size_t path = 0; path < kPathCount; ++path) {
    changes_[path].assign(seen.beams + 1, 0);
    behind_[path].assign(seen.beams + 1, 0.0);
    for (std::size_t b = 0; b < seen.beams; ++b) {
      const SeenSurface& at = seen.at[path][b];
      const bool straight = at.line.straight && at.cos >= kGrazing;
      double behind = 0.0;
      if (straight && path != kMirrored) {
        const double into = at.line.projection(rays[b]);
        behind = (at.line.distance(rays[b].x, rays[b].y) / into - at.range) * std::abs(into);
      }
      const bool changes = (cells[path][b] >= 0 && !(straight && std::abs(behind) <= kMostBehind)) || !goes_on(path, b);
      changes_[path][b + 1] = changes_[path][b] + (changes ? 1 : 0);
      behind_[path][b + 1] = behind_[path][b] + behind;
    }
  }
}

bool StraightWalls::one_wall(std::size_t path, const BeamStretch& stretch, std::size_t beam) const {
  if (changes_[path][stretch.last + 1] != changes_[path][stretch.first]) return false;
  if (cells_[path][beam] < 0) return true;
  const WallLine& line = seen_.at[path][beam].line;
  return has(line, cells_[path][stretch.first]) && has(line, cells_[path][stretch.last]);
}

NearFace StraightWalls::face(std::size_t path, const BeamStretch& stretch, std::size_t beam) const {
  const double sum = behind_[path][stretch.last + 1] - behind_[path][stretch.first];
  return {seen_.at[path][beam].line, sum / static_cast<double>(stretch.last + 1 - stretch.first)};
}

bool StraightWalls::has(const WallLine& line, std::int32_t cell) const {
  return std::abs(line.nx * (cell % width_ + 0.5) + line.ny * (cell / width_ + 0.5) - line.at) <= kOffLine;
}

/// Whether a beam and the one before it end at one wall, or both nowhere.
bool StraightWalls::goes_on(std::size_t path, std::size_t beam) const {
  if (beam == 0) return true;
  const std::int32_t cell = cells_[path][beam], before = cells_[path][beam - 1];
  if (cell < 0 || before < 0) return cell < 0 && before < 0;
  const WallLine &line = seen_.at[path][beam].line, &other = seen_.at[path][beam - 1].line;
  return std::abs(line.nx * other.nx + line.ny * other.ny) >= kSameDirection && has(line, before);
}

}  // namespace glass_nav
