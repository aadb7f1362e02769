/// Where all beams of a part of a scan end at the same straight wall, poses nearby see that wall where its line is: no
/// ray need be cast.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "beam_needs.hpp"
#include "wall_lines.hpp"

namespace glass_nav {

/// One wall as rays from nearby meet it. Lengths are in cells.
struct NearFace {
  WallLine line;
  double behind = 0.0;  // the line, at which distance() ends, is so far behind where rays end, across

  /// Along a ray to where a ray cast would end, on average over the steps of a staircase; not > 0: it does not meet it.
  double range(const Ray& ray) const {
    return (line.distance(ray.x, ray.y) - (line.projection(ray) < 0.0 ? -behind : behind)) / line.projection(ray);
  }
};

/// The runs of neighbouring beams that end at one straight wall, or nowhere, by path.
class StraightWalls {
 public:
  /// @param cells  of the ends, for each path and beam; -1: none
  /// @param rays   from the pose
  StraightWalls(const SeenSurfaces& seen, const std::array<const std::int32_t*, kPathCount>& cells,
                const std::vector<Ray>& rays, int width);

  /// Whether the beams of a stretch, of which `beam` is one, all end at the wall of that beam, or all nowhere.
  bool one_wall(std::size_t path, const BeamStretch& stretch, std::size_t beam) const;

  /// The wall of a beam, with what all beams of the stretch tell of its face. Of a path that is not mirrored.
  NearFace face(std::size_t path, const BeamStretch& stretch, std::size_t beam) const;

 private:
  bool has(const WallLine& line, std::int32_t cell) const;
  bool goes_on(std::size_t path, std::size_t beam) const;

  const SeenSurfaces& seen_;
  const std::array<const std::int32_t*, kPathCount> cells_;
  int width_;
  // Sums over all beams before each: changes from one beam to the next, and how far behind the rays' ends the lines
  // are.
  std::array<std::vector<std::uint32_t>, kPathCount> changes_;
  std::array<std::vector<double>, kPathCount> behind_;
};

}  // namespace glass_nav
