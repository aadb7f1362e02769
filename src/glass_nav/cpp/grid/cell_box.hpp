/// A box of cells of a grid.
#pragma once

#include <algorithm>

namespace glass_nav {

/// Cells with x0 <= x < x1 and y0 <= y < y1.
struct CellBox {
  int x0, y0, x1, y1;

  bool contains(int x, int y) const { return x0 <= x && x < x1 && y0 <= y && y < y1; }

  /// With so many cells more on each side, within a grid.
  CellBox grown(int left, int below, int right, int above, int width, int height) const {
    return {std::max(x0 - left, 0), std::max(y0 - below, 0), std::min(x1 + right, width), std::min(y1 + above, height)};
  }
};

}  // namespace glass_nav
