/// How far a ray may skip ahead from each cell of a grid.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "cell_box.hpp"

namespace glass_nav {

/// Edge of the largest free square that starts in each cell and spreads in the direction of a ray.
///
/// That is the chessboard distance to the nearest blocked cell among those that lie ahead: a ray stays within one
/// quadrant and never meets what is beside or behind it, so past a wall it skips about twice as far. One byte per cell
/// and quadrant: 0 blocked, 255 means 255 or more. Outside the grid nothing is blocked.
class ChessboardDistance {
 public:
  /// @param blocked  height * width cells, row by row; not 0: blocked
  ChessboardDistance(const std::vector<std::uint8_t>& blocked, int width, int height);

  /// Other cells in a box are blocked now.
  /// @param blocked  the cells of the box, row by row; not 0: blocked
  void redraw(const CellBox& box, const std::vector<std::uint8_t>& blocked);

  /// Squares towards -x or +x and -y or +y, row by row.
  const std::uint8_t* towards(bool minus_x, bool minus_y) const { return edge_[2 * minus_y + minus_x].data(); }

 private:
  int width_, height_;
  std::array<std::vector<std::uint8_t>, 4> edge_;
};

}  // namespace glass_nav
