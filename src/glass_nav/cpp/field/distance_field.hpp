/// How far is the nearest wall, and which way does that distance grow? Bilinear between the cells of a grid.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace glass_nav {

/// A distance [m] and its derivatives along x and y of the frame map.
struct Slope {
  double distance, along_x, along_y;
};

class DistanceField {
 public:
  /// distance_m: (height, width) at the centres of the cells. map_from_grid: x, y, yaw of the outer corner of the
  /// first. Distances outside of the grid grow up to max_distance_m.
  DistanceField(const float* distance_m, int height, int width, double resolution_m,
                const std::array<double, 3>& map_from_grid, double max_distance_m)
      : height_(height),
        width_(width),
        resolution_m_(resolution_m),
        per_m_(1.0 / resolution_m),
        max_distance_m_(max_distance_m),
        x_(map_from_grid[0]),
        y_(map_from_grid[1]),
        yaw_(map_from_grid[2]),
        cos_(std::cos(map_from_grid[2])),
        sin_(std::sin(map_from_grid[2])),
        distance_m_(static_cast<std::size_t>(height + 2) * (width + 2)) {
    // One cell of border, so that every point inside has its four neighbours.
    float* to = distance_m_.data();
    for (int row = -1; row <= height; ++row) {
      const float* from = distance_m + static_cast<std::size_t>(inside(row, height)) * width;
      for (int column = -1; column <= width; ++column) *to++ = from[inside(column, width)];
    }
  }

  double distance(double x_m, double y_m) const { return distance(square(x_m, y_m)); }

  /// Distances of points of a frame, as seen from the grid: one rotation for each of them.
  class Placed {
   public:
    /// x, y, yaw of the frame in the map.
    Placed(const DistanceField& field, const std::array<double, 3>& pose)
        : field_(field),
          column_(field.column(pose[0], pose[1])),
          row_(field.row(pose[0], pose[1])),
          cos_(std::cos(pose[2] - field.yaw_) * field.per_m_),
          sin_(std::sin(pose[2] - field.yaw_) * field.per_m_) {}

    double distance(double x_m, double y_m) const {
      return field_.distance(field_.square_at(column_ + cos_ * x_m - sin_ * y_m, row_ + sin_ * x_m + cos_ * y_m));
    }

    /// Whether all points that are at most so far from the frame's origin are inside of the grid.
    bool is_inside(double reach_m) const {
      const double reach = reach_m * field_.per_m_ + 1.0;
      return column_ > reach && row_ > reach && column_ + reach < field_.width_ && row_ + reach < field_.height_;
    }

    /// The same distance, of a point that is inside.
    double distance_inside(double x_m, double y_m) const {
      const double column = column_ + cos_ * x_m - sin_ * y_m, row = row_ + sin_ * x_m + cos_ * y_m;
      const int left = static_cast<int>(column), below = static_cast<int>(row);
      const double right = column - left, up = row - below;
      const float* corner = &field_.distance_m_[static_cast<std::size_t>(below) * (field_.width_ + 2) + left];
      const float* above = corner + field_.width_ + 2;
      const double d00 = corner[0], d01 = corner[1], d10 = above[0], d11 = above[1];
      const double lower = d00 + (d01 - d00) * right, upper = d10 + (d11 - d10) * right;
      return lower + (upper - lower) * up;
    }

   private:
    const DistanceField& field_;
    double column_, row_, cos_, sin_;
  };

  Slope at(double x_m, double y_m) const {
    const Square at = square(x_m, y_m);
    const double lower = at.d00 + (at.d01 - at.d00) * at.right, upper = at.d10 + (at.d11 - at.d10) * at.right;
    const double along_column = ((at.d01 - at.d00) * (1.0 - at.up) + (at.d11 - at.d10) * at.up) * per_m_;
    const double along_row = (upper - lower) * per_m_;
    return {with_outside(lower + (upper - lower) * at.up, at.outside_m), cos_ * along_column - sin_ * along_row,
            sin_ * along_column + cos_ * along_row};
  }

 private:
  /// The four cells around a point, the shares of the next column and row, and how far outside the point is.
  struct Square {
    double d00, d01, d10, d11, right, up, outside_m;
  };

  static int inside(int index, int length) { return index < 0 ? 0 : index < length ? index : length - 1; }

  /// Within [0, most]; 0 for NaN.
  static double within(double value, double most) { return value > 0.0 ? (value < most ? value : most) : 0.0; }

  double with_outside(double distance_m, double outside_m) const {
    return outside_m > 0.0 ? std::fmin(distance_m + outside_m, max_distance_m_) : distance_m;
  }

  double distance(const Square& at) const {
    const double lower = at.d00 + (at.d01 - at.d00) * at.right, upper = at.d10 + (at.d11 - at.d10) * at.right;
    return with_outside(lower + (upper - lower) * at.up, at.outside_m);
  }

  // Of the grid with its border.
  double column(double x_m, double y_m) const { return (cos_ * (x_m - x_) + sin_ * (y_m - y_)) / resolution_m_ + 0.5; }
  double row(double x_m, double y_m) const { return (cos_ * (y_m - y_) - sin_ * (x_m - x_)) / resolution_m_ + 0.5; }

  Square square(double x_m, double y_m) const { return square_at(column(x_m, y_m), row(x_m, y_m)); }

  Square square_at(double column, double row) const {
    const double right = within(column, width_ + 0.999), up = within(row, height_ + 0.999);
    const int left = static_cast<int>(right), below = static_cast<int>(up);
    const float* corner = &distance_m_[static_cast<std::size_t>(below) * (width_ + 2) + left];
    const bool is_outside = right != column || up != row;
    return {corner[0],
            corner[1],
            corner[width_ + 2],
            corner[width_ + 3],
            right - left,
            up - below,
            is_outside ? std::hypot(column - right, row - up) * resolution_m_ : 0.0};
  }

  int height_, width_;
  double resolution_m_, per_m_, max_distance_m_, x_, y_, yaw_, cos_, sin_;
  std::vector<float> distance_m_;
};

}  // namespace glass_nav
