/// How far is the nearest wall, and which way does that distance grow? Bilinear between the cells of a grid.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
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

  /// Distances of one point after the other from many frames. All are computed in loops that compilers turn into vector
  /// instructions, and a point lies in few cells for all of the frames, so that those stay in the cache. In floats,
  /// which are micrometres off, since cells are counted from the first of these.
  class Frames {
   public:
    static constexpr std::size_t kMost = 64;

    /// @param poses  x, y, yaw in the map of each, at least one and at most kMost
    Frames(const DistanceField& field, const std::array<double, 3>* poses, std::size_t count)
        : field_(field),
          count_(count),
          first_column_(field.column(poses[0][0], poses[0][1])),
          first_row_(field.row(poses[0][0], poses[0][1])) {
      for (std::size_t k = 0; k < count; ++k) {
        const std::array<double, 3>& pose = poses[k];
        column_[k] = static_cast<float>(field.column(pose[0], pose[1]) - first_column_);
        row_[k] = static_cast<float>(field.row(pose[0], pose[1]) - first_row_);
        cos_[k] = static_cast<float>(std::cos(pose[2] - field.yaw_) * field.per_m_);
        sin_[k] = static_cast<float>(std::sin(pose[2] - field.yaw_) * field.per_m_);
        moved_ = farther(moved_, std::hypot(column_[k], row_[k]));
        turned_ = farther(turned_, std::hypot(cos_[k] - cos_[0], sin_[k] - sin_[0]));
      }
    }

    __attribute__((always_inline)) void distances(double x_m, double y_m, float* distance_m) const {
      const auto x = static_cast<float>(x_m), y = static_cast<float>(y_m);
      const double apart = moved_ + turned_ * std::sqrt(x_m * x_m + y_m * y_m),
                   margin = apart + kRounding * (1.0 + apart);
      // The least column and row in which the point may lie.
      const double left = std::floor(first_column_ + (cos_[0] * x - sin_[0] * y) - margin);
      const double below = std::floor(first_row_ + (sin_[0] * x + cos_[0] * y) - margin);
      const double widest = 2.0 * margin + 2.0;
      const bool is_inside =
          left >= 0.0 && left + widest < field_.width_ && below >= 0.0 && below + widest < field_.height_;
      if (!is_inside) {  // or not a number
        distances_outside(x, y, distance_m);
        return;
      }
      Values column, row;
      const auto from_left = static_cast<float>(first_column_ - left),
                 from_below = static_cast<float>(first_row_ - below);
      for (std::size_t k = 0; k < count_; ++k) {
        column[k] = column_[k] + from_left + (cos_[k] * x - sin_[k] * y);
        row[k] = row_[k] + from_below + (sin_[k] * x + cos_[k] * y);
      }
      const float* corner = field_.distance_m_.data() + static_cast<std::size_t>(below) * (field_.width_ + 2) +
                            static_cast<std::size_t>(left);
      distances_inside(corner, column, row, distance_m);
    }

   private:
    static constexpr double kRounding = 1e-3;  // [cells]

    using Values = std::array<float, kMost>;

    /// Of two neighbouring cells.
    struct Pair {
      float left, right;
    };

    /// NaN if one is.
    static double farther(double one, double other) { return std::isnan(one) || one >= other ? one : other; }

    /// One after the other; some of the points may lie outside of the grid.
    void distances_outside(float x, float y, float* distance_m) const {
      for (std::size_t k = 0; k < count_; ++k) {
        const double column = first_column_ + column_[k] + (cos_[k] * x - sin_[k] * y);
        const double row = first_row_ + row_[k] + (sin_[k] * x + cos_[k] * y);
        distance_m[k] = static_cast<float>(field_.distance(field_.square_at(column, row)));
      }
    }

    /// @param from  the cell that columns and rows are counted from
    __attribute__((always_inline)) void distances_inside(const float* from, const Values& column, const Values& row,
                                                         float* distance_m) const {
      std::array<std::int32_t, kMost> corner;
      std::array<Pair, kMost> lower_row, upper_row;
      Values right, up;
      const std::int32_t stride = field_.width_ + 2;
      for (std::size_t k = 0; k < count_; ++k) {
        const auto left = static_cast<std::int32_t>(column[k]), below = static_cast<std::int32_t>(row[k]);
        corner[k] = below * stride + left;
        right[k] = column[k] - static_cast<float>(left);
        up[k] = row[k] - static_cast<float>(below);
      }
      for (std::size_t k = 0; k < count_; ++k) {
        std::memcpy(&lower_row[k], from + corner[k], sizeof(Pair));
        std::memcpy(&upper_row[k], from + corner[k] + stride, sizeof(Pair));
      }
      for (std::size_t k = 0; k < count_; ++k) {
        const float lower = lower_row[k].left + (lower_row[k].right - lower_row[k].left) * right[k];
        const float upper = upper_row[k].left + (upper_row[k].right - upper_row[k].left) * right[k];
        distance_m[k] = lower + (upper - lower) * up[k];
      }
    }

    const DistanceField& field_;
    std::size_t count_;
    double first_column_, first_row_;
    Values column_, row_, cos_, sin_;    // from the first frame [cells]; [cells / m]
    double moved_ = 0.0, turned_ = 0.0;  // how far the frames are from the first [cells, cells / m]; NaN if one is
  };

  /// at() of several points, with the same bits: computed in loops that compilers turn into vector instructions, and
  /// each cell comes from memory while the others are looked up.
  struct Slopes {
    static constexpr std::size_t kMost = 64;
    using Values = std::array<double, kMost>;

    Values distance, along_x, along_y;

    /// @param x_m, y_m  of the points, `count` of each, at most kMost
    void find(const DistanceField& field, const Values& x_m, const Values& y_m, std::size_t count) {
      Values column, row, right, up;
      std::array<std::int32_t, kMost> corner;
      const std::int32_t stride = field.width_ + 2;
      bool is_outside = false;
      for (std::size_t i = 0; i < count; ++i) {
        column[i] = field.column(x_m[i], y_m[i]);
        row[i] = field.row(x_m[i], y_m[i]);
        right[i] = within(column[i], field.width_ + 0.999);
        up[i] = within(row[i], field.height_ + 0.999);
      }
      for (std::size_t i = 0; i < count; ++i) {
        const auto left = static_cast<std::int32_t>(right[i]), below = static_cast<std::int32_t>(up[i]);
        corner[i] = below * stride + left;
        __builtin_prefetch(field.distance_m_.data() + corner[i]);
        __builtin_prefetch(field.distance_m_.data() + corner[i] + stride);
        is_outside |= right[i] != column[i] || up[i] != row[i];
      }
      find_inside(field, right, up, corner, count);
      if (!is_outside) return;
      for (std::size_t i = 0; i < count; ++i) {
        const bool outside = right[i] != column[i] || up[i] != row[i];
        const double outside_m = outside ? std::hypot(column[i] - right[i], row[i] - up[i]) * field.resolution_m_ : 0.0;
        distance[i] = field.with_outside(distance[i], outside_m);
      }
    }

   private:
    /// Of points in the grid, by the cell that they lie in and how far they are from its corner.
    void find_inside(const DistanceField& field, const Values& right, const Values& up,
                     const std::array<std::int32_t, kMost>& corner, std::size_t count) {
      Values d00, d01, d10, d11;
      for (std::size_t i = 0; i < count; ++i) {
        const float* from = field.distance_m_.data() + corner[i];
        d00[i] = from[0];
        d01[i] = from[1];
        d10[i] = from[field.width_ + 2];
        d11[i] = from[field.width_ + 3];
      }
      for (std::size_t i = 0; i < count; ++i) {
        const double along_right = right[i] - static_cast<std::int32_t>(right[i]);
        const double along_up = up[i] - static_cast<std::int32_t>(up[i]);
        const double lower = d00[i] + (d01[i] - d00[i]) * along_right, upper = d10[i] + (d11[i] - d10[i]) * along_right;
        const double along_column =
            ((d01[i] - d00[i]) * (1.0 - along_up) + (d11[i] - d10[i]) * along_up) * field.per_m_;
        const double along_row = (upper - lower) * field.per_m_;
        distance[i] = lower + (upper - lower) * along_up;
        along_x[i] = field.cos_ * along_column - field.sin_ * along_row;
        along_y[i] = field.sin_ * along_column + field.cos_ * along_row;
      }
    }
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
