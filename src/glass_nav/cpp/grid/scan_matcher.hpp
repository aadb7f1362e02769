/// At which position and heading on a grid do the end points of a scan fit best? All are searched, by branch and bound.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace glass_nav {

/// A place of the robot: a cell and one of the headings that were tried.
struct Match {
  std::int32_t row, column, heading;
  float score;  // mean over the points, 0..255
};

/// Correlative scan matching after Olson (2009), with the bounds of Hess, Kohler, Rapp, Andor (2016): the score of a
/// square of positions is at most that of the best cells which its points can reach. Unlike there, the result
/// is not one best place but many different ones: each square of kBlock cells gives its best position for each heading.
class ScanMatcher {
 public:
  static constexpr int kLevels = 3;
  static constexpr int kBlock = 1 << kLevels;  // cells

  /// scores: (height, width) how well a point lies in each cell, 0 outside; allowed: where the robot may be, not 0.
  ScanMatcher(const std::uint8_t* scores, const std::uint8_t* allowed, int height, int width);

  int width() const { return width_; }
  int height() const { return height_; }

  /// At most keep places, one a block and heading, the best first. points: (count, 2) in cells, from the robot.
  std::vector<Match> search(const double* points, std::size_t count, const double* headings_rad,
                            std::size_t heading_count, std::size_t keep) const;

 private:
  /// Best value in the squares of 2^level cells that start at each cell, including those across the left and lower
  /// border.
  struct Pooled {
    int width = 0, height = 0, border = 0;
    std::vector<std::uint8_t> best;

    std::uint8_t at(int x, int y) const {
      x += border;
      y += border;
      if (static_cast<unsigned>(x) >= static_cast<unsigned>(width)) return 0;
      if (static_cast<unsigned>(y) >= static_cast<unsigned>(height)) return 0;
      return best[static_cast<std::size_t>(y) * width + x];
    }
  };
  struct Offset {
    int x, y;
  };
  struct Square {
    std::int32_t bound;  // of the summed scores within
    std::int32_t heading, row, column;

    bool operator<(const Square& other) const {  // equal bounds: in the order of creation
      if (bound != other.bound) return bound < other.bound;
      if (heading != other.heading) return heading > other.heading;
      if (row != other.row) return row > other.row;
      return column > other.column;
    }
  };

  static Pooled doubled(const Pooled& half, int level);
  std::int32_t sum(const Pooled& scores, const std::vector<Offset>& points, int row, int column) const;
  void descend(const std::vector<Offset>& points, const Square& square, int level, Square& best) const;

  int width_, height_;
  std::array<Pooled, kLevels + 1> scores_, allowed_;
};

}  // namespace glass_nav
