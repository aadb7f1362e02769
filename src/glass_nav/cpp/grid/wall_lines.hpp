/// The lines of straight walls: where a ray crosses a wall, not the staircase of cells that the wall is drawn as.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "grid_walk.hpp"
#include "wall_normals.hpp"

namespace glass_nav {

constexpr double kMinCos = 0.2;  // a surface seen flatter than 78 degrees is no worse placed than at that

/// The line through the cells of a straight wall. Lengths are in cells, in the frame of the grid.
struct WallLine {
  static constexpr float kBothFaces = 3.0F;  // a wall up to so thick has one line through all its cells

  bool straight = false;      // false: the cell has no line
  double nx = 0.0, ny = 0.0;  // unit normal
  double at = 0.0;            // n . p for all points p of the line
  double middle = 0.0;        // from the line to the one half a cell behind either face

  /// Along the normal from a point to the line that lies half a cell behind the face on the point's side.
  double distance(double x, double y) const {
    const double off = at - nx * x - ny * y;
    return off - (off > 0.0 ? middle : off < 0.0 ? -middle : 0.0);
  }

  double projection(const Ray& ray) const { return nx * ray.dx + ny * ray.dy; }
};

/// Finds them by cell.
class WallLines {
 public:
  /// @param thickness_m  of the wall at each cell of the grid
  WallLines(const WallNormals& normals, const float* thickness_m, int width, double resolution_m, double min_linearity)
      : normals_(normals),
        thickness_m_(thickness_m),
        width_(width),
        resolution_m_(resolution_m),
        min_linearity_(min_linearity) {}

  bool straight(const WallNormals::Normal& normal) const {
    return normal.linearity > 0.0F && normal.linearity >= min_linearity_;
  }
  WallNormals::Normal normal(std::int32_t cell) const { return normals_.at(cell); }
  bool straight(std::int32_t cell) const { return straight(normals_.at(cell)); }

  WallLine of(std::int32_t cell) const {
    WallLine line;
    if (cell < 0) return line;
    const WallNormals::Normal normal = normals_.at(cell);
    if (!straight(normal)) return line;
    line.straight = true;
    line.nx = normal.x;
    line.ny = normal.y;
    line.at = line.nx * (cell % width_ + 0.5) + line.ny * (cell / width_ + 0.5) + normal.offset;
    const float cells = thickness_m_[cell] / static_cast<float>(resolution_m_);  // double would exceed whole numbers
    if (cells <= WallLine::kBothFaces) line.middle = std::max(0.5 * (cells - 1.0), 0.0);
    return line;
  }

 private:
  const WallNormals& normals_;
  const float* thickness_m_;
  int width_;
  double resolution_m_, min_linearity_;
};

}  // namespace glass_nav
