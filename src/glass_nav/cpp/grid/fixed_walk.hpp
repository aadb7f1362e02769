/// One ray on its path through the cells of a grid, where it passes no corner between them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "grid_walk.hpp"

namespace glass_nav {

/// A GridWalk for the clear case, with the same result to the last bit but a fraction of the arithmetic and state.
///
/// It handles only rays that start in the grid and pass no corner between cells. A ray that crosses two grid lines
/// within a ten-millionth of a cell is doubtful: a GridWalk, which handles corners, has to follow it from its origin.
///
/// Coordinates are fixed-point numbers with kPointBits fractional bits: the integer part is the cell, the fraction
/// tells whether a grid line is near. They are kNudge too large, so that a coordinate that has just crossed a line is
/// always beyond it, whatever the rounding.
class FixedWalk {
  /// One coordinate of an origin: as it is for rays towards +, mirrored for those towards -.
  struct AxisOrigin {
    AxisOrigin() = default;
    AxisOrigin(double origin, int size)
        : start{origin, size - origin}, cell{static_cast<int>(origin), size - 1 - static_cast<int>(origin)} {}

    std::array<double, 2> start{};
    std::array<std::int64_t, 2> cell{};
  };

 public:
  /// Where rays start.
  struct Origin {
    Origin() = default;
    Origin(double x, double y, int width, int height)
        : is_plain(std::max(width, height) <= kMostCells && x >= 0.0 && y >= 0.0 && x < width && y < height) {
      if (!is_plain) return;
      of_x = {x, width};
      of_y = {y, height};
    }

    AxisOrigin of_x, of_y;
    bool is_plain = false;  // otherwise rays from here are doubtful
  };

  FixedWalk() = default;  // to be assigned to

  FixedWalk(const Ray& ray, int width, int height, double t_max)
      : FixedWalk(Origin(ray.x, ray.y, width, height), ray, width, height, t_max) {}

  FixedWalk(const Origin& origin, const Ray& ray, int width, int height, double t_max)
      : t_max_(t_max), width_(width), height_(height), minus_x_(turned(ray.dx)), minus_y_(turned(ray.dy)) {
    is_doubtful_ = !origin.is_plain;
    if (is_doubtful_) return;
    x_.begin(origin.of_x, ray.dx, minus_x_);
    y_.begin(origin.of_y, ray.dy, minus_y_);
    cell_ = static_cast<std::int32_t>(origin.of_y.cell[0] * width + origin.of_x.cell[0]);
    // Products, not branches: the signs of directions are unpredictable.
    cell_0_ = minus_x_ * (width - 1) + minus_y_ * (height - 1) * width;
    step_x_ = 1 - 2 * minus_x_;
    step_y_ = (1 - 2 * minus_y_) * width;
    is_inside_ = 0.0 <= t_max;
  }

  /// False once the ray has left the grid or is longer than t_max.
  bool inside() const { return is_inside_; }

  /// True once it came so near to a corner that nothing of the walk can be trusted.
  bool is_doubtful() const { return is_doubtful_; }
  static constexpr bool near_corner() { return false; }  // else it is doubtful

  /// Length of the ray where it entered the present cell.
  double t() const { return t_; }

  double t_max() const { return t_max_; }

  /// Flat index (row * width + column) of the present cell.
  std::int32_t cell() const { return cell_; }

  bool minus_x() const { return minus_x_; }
  bool minus_y() const { return minus_y_; }

  /// As GridWalk::leap().
  void leap(int cells) {
    t_ = std::min(x_.crossing(cells), y_.crossing(cells));
    const std::int64_t x = x_.fixed(t_), y = y_.fixed(t_);
    // The coordinate that crosses its line is now kNudge beyond it. A corner is near if the other one is no more than
    // twice that beyond a line too, that is, kNudge before or behind it without the nudge.
    is_doubtful_ = static_cast<std::uint32_t>(x | y) < 2 * kNudge;
    x_.cell = x >> kPointBits;
    y_.cell = y >> kPointBits;
    is_inside_ = t_ <= t_max_ && x_.cell < width_ && y_.cell < height_;
    cell_ = cell_0_ + static_cast<std::int32_t>(x_.cell) * step_x_ + static_cast<std::int32_t>(y_.cell) * step_y_;
  }

 private:
  static constexpr int kPointBits = 32;
  static constexpr double kPoint = 4294967296.0;  // 2^kPointBits: multiplying by it rounds nothing
  static constexpr std::int64_t kNudge = 512;     // 1.2e-7 cells: a hundred times GridWalk::kCorner
  static constexpr int kMostCells = 1 << 20;      // along an edge of the grid; up to here rounding is far below kNudge

  static bool turned(double direction) { return direction <= -GridWalk::kAxisParallel; }

  /// One coordinate of a ray, mirrored so that it never decreases; its t are those of GridWalk to the last bit.
  struct Axis {
    void begin(const AxisOrigin& origin, double direction, bool turned) {
      const double absolute = std::abs(direction);
      const double speed = absolute < GridWalk::kAxisParallel ? 0.0 : absolute;
      start = origin.start[turned];
      cell = origin.cell[turned];
      per_speed = 1.0 / speed;  // inf for a ray along the other axis
      fixed_start = start * kPoint + kNudge;
      fixed_speed = speed * kPoint;
    }

    /// t at which the ray crosses the grid line that is so many cells ahead.
    double crossing(int cells) const { return (static_cast<int>(cell) + cells - start) * per_speed; }

    /// The nudged coordinate at t.
    std::int64_t fixed(double t) const { return static_cast<std::int64_t>(fixed_start + t * fixed_speed); }

    double start, per_speed;
    double fixed_start, fixed_speed;
    std::int64_t cell;
  };

  Axis x_, y_;
  double t_ = 0.0;
  double t_max_ = 0.0;
  std::int32_t width_ = 0, height_ = 0;
  std::int32_t cell_ = 0;
  std::int32_t cell_0_ = 0, step_x_ = 0, step_y_ = 0;  // of the cell that is (0, 0) after mirroring, and from it
  bool minus_x_ = false, minus_y_ = false, is_inside_ = false, is_doubtful_ = true;
};

}  // namespace glass_nav
