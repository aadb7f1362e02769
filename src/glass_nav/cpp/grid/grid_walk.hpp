/// One ray on its path through the cells of a grid.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace glass_nav {

/// A ray in grid coordinates: cell [0, 0] is the square from (0, 0) to (1, 1), lengths are in cells.
struct Ray {
  double x, y;    // origin
  double dx, dy;  // unit vector
};

/// The walk of one ray from cell to cell.
///
/// The axes are mirrored where needed so that every ray runs towards +x and +y; `cell()` mirrors back. The position on
/// the ray is kept as the cell entered (integers) and the exact parameter t at which the ray crossed into it: nothing
/// accumulates, so a walk of ten thousand cells is as exact as its first step.
class GridWalk {
 public:
  // Two crossings this close [cells] are one corner: far above the rounding of the sums that place a pose on a map
  // (1e-12), far below what a map or a sensor resolves.
  static constexpr double kCorner = 1e-9;
  // A component of a direction this small is rounding: cos(pi / 2) is 6e-17, not 0.
  static constexpr double kAxisParallel = 1e-12;

  GridWalk() : GridWalk({0.0, 0.0, 1.0, 0.0}, 1, 1, 0.0) {}  // to be assigned to

  /// Starts in the cell of the origin, or, if that is outside the grid, in the first cell that the ray enters.
  GridWalk(const Ray& ray, int width, int height, double t_max)
      : x_axis_(ray.x, ray.dx, width), y_axis_(ray.y, ray.dy, height), t_max_(t_max) {
    cell_ = (x_axis_.turned ? width - 1 : 0) + (y_axis_.turned ? (height - 1) * width : 0);
    step_x_ = x_axis_.turned ? -1 : 1;
    step_y_ = y_axis_.turned ? -width : width;
    if (x_axis_.starts_inside() && y_axis_.starts_inside()) return;
    enter_from_outside();
  }

  /// False once the ray has left the grid or is longer than t_max.
  bool inside() const { return t_ <= t_max_ && x_axis_.cell < x_axis_.size && y_axis_.cell < y_axis_.size; }

  static constexpr bool is_doubtful() { return false; }  // as a FixedWalk may be

  /// Length of the ray where it entered the present cell.
  double t() const { return t_; }

  double t_max() const { return t_max_; }

  /// Flat index (row * width + column) of the present cell.
  std::int32_t cell() const { return index(x_axis_.cell, y_axis_.cell); }

  bool minus_x() const { return x_axis_.turned; }
  bool minus_y() const { return y_axis_.turned; }

  /// Goes on to the first cell beyond the square of `cells` that starts in the present one and lies ahead.
  ///
  /// The square must hold nothing of interest; 1 steps into the very next cell.
  void leap(int cells) {
    const double tx = x_axis_.crossing(x_axis_.cell + cells);
    const double ty = y_axis_.crossing(y_axis_.cell + cells);
    // Which axis is crossed first is unpredictable: a branch on it would be mispredicted half of the time, so both
    // coordinates take the same code and only their bounds differ.
    t_ = std::min(tx, ty);
    crossed_x_ = tx < ty;
    const double off_x = x_axis_.follow(t_, cells, crossed_x_);
    const double off_y = y_axis_.follow(t_, cells, !crossed_x_);
    off_boundary_ = std::min(off_x, off_y);
  }

  /// False if the ray certainly did not enter the present cell at a corner.
  bool near_corner() const { return off_boundary_ <= kCorner; }

  /// The other cell at a corner. A ray that goes exactly through a corner touches both cells beside it; the walk visits
  /// one of them before the corner is behind it, or none. -1 if there is no corner or nothing beside it.
  std::int32_t cell_beside_corner() const {
    if (!near_corner()) return -1;
    const Axis& other = crossed_x_ ? y_axis_ : x_axis_;
    const int back_x = crossed_x_ ? 1 : 0, back_y = 1 - back_x;  // where the walk came from
    if (other.just_entered(t_)) return index_or_none(x_axis_.cell - back_y, y_axis_.cell - back_x);
    if (other.about_to_leave(t_)) return index_or_none(x_axis_.cell + back_y - back_x, y_axis_.cell + back_x - back_y);
    return -1;
  }

 private:
  /// One coordinate of the walk, mirrored so that it never decreases.
  struct Axis {
    Axis(double origin, double direction, int cells) : size(cells) {
      if (std::abs(direction) < kAxisParallel) direction = 0.0;
      turned = direction < 0.0;
      const int start_cell = origin < 0.0 ? -1 : origin < cells ? static_cast<int>(origin) : cells;
      start = turned ? size - origin : origin;
      speed = std::abs(direction);
      per_speed = speed > 0.0 ? 1.0 / speed : std::numeric_limits<double>::infinity();
      cell = turned ? size - 1 - start_cell : start_cell;
      first_legal = std::max(cell, 0);
    }

    bool starts_inside() const { return cell >= 0 && cell < size; }

    /// t at which the ray crosses the lower boundary of a cell ahead.
    double crossing(int ahead) const { return (ahead - start) * per_speed; }

    /// Goes to the cell at t, which is `cells` ahead if that boundary is the one crossed, and nearer otherwise:
    /// rounding does not matter. Returns how far the coordinate is from the nearest boundary [cells]; 1 and more if
    /// crossed.
    double follow(double t, int cells, int crossed) {
      const double coordinate = start + t * speed;
      const int before = static_cast<int>(coordinate);
      const int reached = std::min(std::max(before, cell), cell + cells - 1);
      cell = std::max(reached, cell + (cells & -crossed));
      const double past = coordinate - reached;
      return std::min(past, 1.0 - past) + crossed;
    }

    /// The cell at t, where the ray enters the grid; `size` if it passes by.
    void enter(double t) {
      cell = static_cast<int>(
          std::clamp(std::floor(start + t * speed), std::max<double>(cell, 0.0), static_cast<double>(size)));
    }

    /// True if the lower boundary of the cell was crossed at this very t.
    bool just_entered(double t) const { return cell > first_legal && t - crossing(cell) <= kCorner; }

    /// True if the next cell is entered at this very t.
    bool about_to_leave(double t) const { return crossing(cell + 1) - t <= kCorner; }

    double start;      // coordinate of the origin
    double speed;      // cells per unit of t, >= 0
    double per_speed;  // its inverse, inf for a ray along the other axis
    int cell;
    int size;
    int first_legal;  // the boundary below this cell is not crossed by the ray, or it is the border of the grid
    bool turned;
  };

  void enter_from_outside() {
    const double tx = x_axis_.cell < 0 ? x_axis_.crossing(0) : 0.0;
    const double ty = y_axis_.cell < 0 ? y_axis_.crossing(0) : 0.0;
    t_ = std::max(tx, ty);
    crossed_x_ = x_axis_.cell < 0 && tx >= ty;
    off_boundary_ = 0.0;
    if (t_ > t_max_) return;
    x_axis_.enter(t_);
    y_axis_.enter(t_);
  }

  std::int32_t index_or_none(int x, int y) const {
    return x >= 0 && y >= 0 && x < x_axis_.size && y < y_axis_.size ? index(x, y) : -1;
  }

  std::int32_t index(int x, int y) const { return cell_ + x * step_x_ + y * step_y_; }

  Axis x_axis_, y_axis_;
  double t_max_;
  double t_ = 0.0;
  double off_boundary_ = 1.0;  // distance from the nearest corner of the cell where it was entered
  std::int32_t cell_;          // flat index of the cell that is (0, 0) after mirroring
  std::int32_t step_x_, step_y_;
  bool crossed_x_ = false;
};

}  // namespace glass_nav
