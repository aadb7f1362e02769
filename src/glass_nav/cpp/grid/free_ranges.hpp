/// How far are rays free, by another library's rays?
#pragma once

#include <cstdint>

#include "cell_box.hpp"
#include "grid_walk.hpp"

namespace glass_nav {

/// The rays of another library on the same cells. Frame of the grid: cell [0, 0] starts at (0, 0), no rotation.
class FreeRanges {
 public:
  FreeRanges() = default;
  FreeRanges(const FreeRanges&) = delete;
  FreeRanges& operator=(const FreeRanges&) = delete;
  virtual ~FreeRanges() = default;

  /// How far the ray is free, looking from its length t to t_max [cells]; inf if nothing is found.
  virtual double along(const Ray& ray, double t, double t_max) const = 0;

  /// Cells in a box have changed; occupancy is that of the whole grid.
  virtual void redraw(const std::int8_t* occupancy, const CellBox& box) = 0;
};

}  // namespace glass_nav
