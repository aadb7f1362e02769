/// Two ways to find the next occupied cell on a ray.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include <mrpt/maps/COccupancyGridMap2D.h>

#include "grid_walk.hpp"

namespace glass_nav {

/// The cells as rays see them; all arrays are row-major and belong to the raycaster.
struct GridCells {
  int width, height;
  const std::uint8_t* distance;  // chessboard distance to the nearest cell where a ray may end, see distance_field.hpp
  const std::uint8_t* occupied;  // not 0: a surface

  /// A cell that ends a ray without being a surface (unknown, if those are to stop a ray).
  bool stops(std::int32_t cell) const { return distance[cell] == 0 && occupied[cell] == 0; }

  /// The occupied cell that the ray meets where the walk stands: its own or one beside the corner; -1 none.
  template <class Ignored>
  std::int32_t met(const GridWalk& walk, const Ignored& ignored) const {
    const std::int32_t cell = walk.cell();
    if (occupied[cell] != 0 && !ignored(cell)) return cell;
    const std::int32_t beside = walk.cell_beside_corner();
    return beside >= 0 && occupied[beside] != 0 && !ignored(beside) ? beside : -1;
  }
};

/// For rays that take every occupied cell as it comes.
struct NothingIgnored {
  bool operator()(std::int32_t) const { return false; }
};

/// Leaps over free space by the chessboard distance; exact.
class ExactSeeker {
 public:
  explicit ExactSeeker(const GridCells& cells) : cells_(cells) {}

  /// Walks on to the next occupied cell that is not ignored. Returns it, or -1 where the ray ends before.
  template <class Ignored>
  std::int32_t seek(const Ray&, GridWalk& walk, const Ignored& ignored) const {
    while (walk.inside()) {
      const int distance = cells_.distance[walk.cell()];
      if (distance <= 1) {  // only here can a cell beside a corner be occupied: it would touch the present one
        const std::int32_t met = cells_.met(walk, ignored);
        if (met >= 0) return met;
        if (cells_.stops(walk.cell())) return -1;
      }
      walk.leap(std::max(distance, 1));
    }
    return -1;
  }

 private:
  GridCells cells_;
};

/// Asks simulateScanRay how far it is free, then looks at the cells on the way itself.
///
/// What simulateScanRay (MRPT 2.1 to 2.14) does wrong, and what happens here:
/// - it samples every 0.8 cell and reports the sample, up to 0.8 cell late: the walk gives the cell boundary;
/// - between two samples it slips through corners of cells, and so through thin walls: the walk visits every cell up
///   to the reported range;
/// - its steps are rounded to 1/1024 cell, so long rays drift aside and hit what the true ray passes: if the walk finds
///   nothing where it reported a hit, it is asked again from there on;
/// - it makes max_range / resolution steps, so it stops at 0.8 max_range: it is given 1 / 0.8 of the range;
/// - with a threshold of 0.5 an unknown cell ends the ray as invalid: unknown cells pass its threshold here, and the
///   walk stops at them where that is asked for.
class MrptSeeker {
 public:
  MrptSeeker(const GridCells& cells, const mrpt::maps::COccupancyGridMap2D& map, double resolution_m)
      : cells_(cells), map_(map), resolution_m_(resolution_m) {}

  template <class Ignored>
  std::int32_t seek(const Ray& ray, GridWalk& walk, const Ignored& ignored) const {
    while (walk.inside()) {
      const double look_until = walk.t() + free_cells(ray, walk.t(), walk.t_max()) + kMarginCells;
      for (; walk.inside() && walk.t() <= look_until; walk.leap(1)) {
        const std::int32_t met = cells_.met(walk, ignored);
        if (met >= 0) return met;
        if (cells_.stops(walk.cell())) return -1;
      }
    }
    return -1;
  }

  /// simulateScanRay as it is, looking from ray length t to t_max [cells]; inf if it finds nothing.
  double free_cells(const Ray& ray, double t, double t_max) const {
    float range_m = 0.0F;
    bool valid = false;
    map_.simulateScanRay((ray.x + t * ray.dx) * resolution_m_, (ray.y + t * ray.dy) * resolution_m_,
                         std::atan2(ray.dy, ray.dx), range_m, valid, (t_max - t) * resolution_m_ / kStepCells,
                         kPassFrom);
    return valid ? range_m / resolution_m_ : std::numeric_limits<double>::infinity();
  }

 private:
  static constexpr double kStepCells = 0.8;    // of simulateScanRay
  static constexpr double kMarginCells = 2.0;  // it reports the sample before or after the boundary
  static constexpr float kPassFrom = 0.4F;     // a cell that is free with at least this probability lets a ray pass

  GridCells cells_;
  const mrpt::maps::COccupancyGridMap2D& map_;
  double resolution_m_;
};

}  // namespace glass_nav
