/// What the map knows of places. The formulation is in sensing/known_area.py.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace glass_nav {

/// Of a cell, as in sensing/known_area.py.
enum CellFlag : std::uint8_t { kKnown = 1, kUnmapped = 2, kFree = 4, kBeside = 8 };

class KnownArea {
 public:
  /// flags: (height, width) of the cells of a grid and of a border around it. map_from_grid: x, y, yaw of the outer
  /// corner of the grid's first cell.
  KnownArea(const std::uint8_t* flags, int height, int width, int border, double resolution_m,
            const std::array<double, 3>& map_from_grid)
      : height_(height),
        width_(width),
        border_(border),
        resolution_m_(resolution_m),
        x_(map_from_grid[0]),
        y_(map_from_grid[1]),
        cos_(std::cos(map_from_grid[2])),
        sin_(std::sin(map_from_grid[2])),
        flags_(flags, flags + static_cast<std::size_t>(height) * width) {}

  /// At a point of the frame map; outside of the border and for NaN, that of the outermost cells.
  bool has(CellFlag flag, double x_m, double y_m) const {
    const double x = x_m - x_, y = y_m - y_;
    const std::size_t column = index((cos_ * x + sin_ * y) / resolution_m_, width_);
    const std::size_t row = index((cos_ * y - sin_ * x) / resolution_m_, height_);
    return (flags_[row * width_ + column] & flag) != 0;
  }

 private:
  std::size_t index(double cells, int length) const {
    const double inside = std::floor(cells) + border_;
    return inside > 0.0 ? static_cast<std::size_t>(inside < length - 1 ? inside : length - 1) : 0;
  }

  int height_, width_, border_;
  double resolution_m_, x_, y_, cos_, sin_;
  std::vector<std::uint8_t> flags_;
};

}  // namespace glass_nav
