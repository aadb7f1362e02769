/// What lies along one ray: up to three surfaces, what was passed between them, and the mirrored path.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "grid_walk.hpp"
#include "seekers.hpp"
#include "wall_normals.hpp"

namespace glass_nav {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Lengths in cells.
struct SurfaceRules {
  double max_thickness;  // along the normal; a thicker run ends the ray
  double min_linearity;  // below it a cell has no normal
  double min_gap;        // a shorter free gap on the ray does not part two surfaces
};

struct Surfaces {
  std::array<double, 3> range{kInfinity, kInfinity, kInfinity};
  std::array<std::int32_t, 3> cell{-1, -1, -1};
  std::array<double, 2> thickness{kInfinity, kInfinity};
  WallNormals::Normal normal{std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::quiet_NaN(),
                             0.0F};  // of the first, towards the origin
  double mirrored = kInfinity;
};

/// Looks along rays and through what they meet.
template <class Seeker>
class SurfaceFinder {
 public:
  SurfaceFinder(const GridCells& cells, const Seeker& seeker, const WallNormals& normals, const SurfaceRules& rules)
      : cells_(cells), seeker_(seeker), normals_(normals), rules_(rules) {}

  Surfaces along(const Ray& ray, double t_max) const {
    Surfaces found;
    GridWalk walk(ray, cells_.width, cells_.height, t_max);
    for (std::size_t i = 0; i < found.range.size(); ++i) {
      found.cell[i] = seeker_.seek(ray, walk, NothingIgnored{});
      if (found.cell[i] < 0) break;
      found.range[i] = walk.t();
      if (i == 2) break;  // what is behind the third surface is nobody's business
      const WallNormals::Normal normal = facing(normals_.at(found.cell[i]), ray);
      if (i == 0) {
        found.normal = normal;
        found.mirrored = mirrored(ray, walk.t(), found.cell[0], normal, t_max);
      }
      const double cos_incidence = usable(normal) ? -projection(normal, ray) : 1.0;
      const double length = pass_run(walk, rules_.max_thickness / cos_incidence);
      if (length == kInfinity) break;
      found.thickness[i] = length * cos_incidence;
      if (!walk.inside()) break;
    }
    return found;
  }

 private:
  /// The line of a wall within the patch that gave its normal: cells of the mirror itself, which the staircase of a
  /// slanted wall puts in the way of the mirrored ray.
  struct MirrorItself {
    int width;
    std::int32_t cell;
    double nx, ny;

    bool operator()(std::int32_t other) const {
      const int dx = other % width - cell % width, dy = other / width - cell / width;
      const bool near = std::max(std::abs(dx), std::abs(dy)) <= WallNormals::kRadiusCells;
      return near && std::abs(nx * dx + ny * dy) <= 1.5;  // cells; a wall drawn one to two cells thick
    }
  };

  bool usable(const WallNormals::Normal& normal) const {
    return normal.linearity > 0.0F && normal.linearity >= rules_.min_linearity;
  }

  static double projection(const WallNormals::Normal& normal, const Ray& ray) {
    return normal.x * ray.dx + normal.y * ray.dy;
  }

  static WallNormals::Normal facing(WallNormals::Normal normal, const Ray& ray) {
    if (projection(normal, ray) <= 0.0) return normal;  // also if it is NaN
    return {-normal.x, -normal.y, normal.linearity};
  }

  /// Leaves the run of occupied cells in which the walk stands, gaps too short to count included.
  ///
  /// Returns its length along the ray. inf if it is longer than max_length, or the ray ends in it.
  double pass_run(GridWalk& walk, double max_length) const {
    const double min_gap = std::max(rules_.min_gap, GridWalk::kCorner);
    const double t_in = walk.t();
    double t_out = t_in;
    for (;;) {
      const bool occupied = cells_.occupied(walk.cell());
      walk.leap(1);
      if (occupied) t_out = walk.t();
      if (t_out - t_in > max_length || t_out > walk.t_max()) return kInfinity;
      if (!walk.inside() || walk.t() - t_out >= min_gap) return t_out - t_in;
      if (cells_.met(walk, NothingIgnored{}) >= 0) {
        t_out = walk.t();
      } else if (cells_.stops(walk.cell())) {
        return kInfinity;
      }
    }
  }

  /// Path from the origin to the mirror at t and on along u - 2 (u . n) n to the next surface.
  double mirrored(const Ray& ray, double t, std::int32_t cell, const WallNormals::Normal& normal,
                  double t_max) const {
    if (!usable(normal)) return kInfinity;
    const double nx = normal.x, ny = normal.y;
    const double into = projection(normal, ray);
    const Ray reflected{ray.x + t * ray.dx, ray.y + t * ray.dy, ray.dx - 2.0 * into * nx, ray.dy - 2.0 * into * ny};
    GridWalk walk(reflected, cells_.width, cells_.height, t_max - t);
    const MirrorItself mirror{cells_.width, cell, nx, ny};
    return seeker_.seek(reflected, walk, mirror) < 0 ? kInfinity : t + walk.t();
  }

  const GridCells& cells_;
  const Seeker& seeker_;
  const WallNormals& normals_;
  SurfaceRules rules_;
};

}  // namespace glass_nav
