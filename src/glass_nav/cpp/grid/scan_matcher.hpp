/// At which position and heading on a grid do the end points of a scan fit best? All are searched, by branch and bound.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <queue>
#include <vector>

namespace glass_nav {

/// A place of the robot: a cell and one of the headings that were tried.
struct Match {
  std::int32_t row, column, heading;
  float score;  // mean over the points, 0..255
};

/// The grid that scans are matched against, with the bounds of Hess, Kohler, Rapp, Andor (2016): the score of a square
/// of positions is at most that of the best cells which its points can reach.
class MatchGrid {
 public:
  static constexpr int kLevels = 3;
  static constexpr int kBlock = 1 << kLevels;  // cells

  /// scores: (height, width) how well a point lies in each cell, 0 outside; allowed: where the robot may be, not 0.
  MatchGrid(const std::uint8_t* scores, const std::uint8_t* allowed, int height, int width);

  int width() const { return width_; }
  int height() const { return height_; }
  int block_rows() const { return (height_ + kBlock - 1) / kBlock; }
  int block_columns() const { return (width_ + kBlock - 1) / kBlock; }

 private:
  friend class ScanSearch;

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

  /// The highest level, its cells sorted by their place in the blocks: the cells that one point meets from all blocks
  /// of a row lie side by side, and are added up many at a time.
  struct Planes {
    int width = 0, height = 0;  // of each of the kBlock * kBlock planes; its first row and column are one block below 0
    std::vector<std::uint8_t> best;

    /// Those that a point (x, y) meets from the blocks of a row of blocks: of block `first` on, `count` of them.
    const std::uint8_t* row(int x, int y, int block_row, int& first, int& count) const;
  };

  static Pooled doubled(const Pooled& half);
  static Planes sorted(const Pooled& pooled);

  int width_, height_;
  std::array<Pooled, kLevels> scores_;
  std::array<Pooled, kLevels + 1> allowed_;
  Planes blocks_;
};

/// One scan matched against every pose in a grid: correlative scan matching after Olson (2009). Unlike there, the
/// result is not one best place but many different ones: each block gives its best position for each heading. The work
/// is done in slices, as much at a time as the caller has time for.
class ScanSearch {
 public:
  /// At most `keep` places, none of whose scores is further than `max_behind`, a share of the highest score that there
  /// is, behind that of the best. points: (count, 2) in cells, from the robot.
  ScanSearch(std::shared_ptr<const MatchGrid> grid, const double* points, std::size_t count, const double* headings_rad,
             std::size_t heading_count, std::size_t keep, double max_behind);

  /// Goes on until about so many scores were looked up; whether all is done.
  bool advance(std::size_t look_ups);

  std::size_t look_ups() const { return look_ups_; }

  /// One a block and heading, the best first; what was found so far.
  std::vector<Match> places() const;

 private:
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
    bool operator>(const Square& other) const { return other < *this; }
  };

  void bound_row(std::int32_t heading, int block_row);
  std::int32_t sum(const MatchGrid::Pooled& scores, const std::vector<Offset>& points, int row, int column);
  void descend(const std::vector<Offset>& points, const Square& square, int level, Square& best);

  std::shared_ptr<const MatchGrid> grid_;
  std::size_t point_count_, keep_;
  std::int32_t max_behind_;                  // of the summed scores
  std::int32_t highest_ = 0;                 // sum so far
  std::vector<std::vector<Offset>> turned_;  // the points, for each heading
  std::size_t next_row_ = 0;                 // of blocks, over all headings: the next to be bounded
  std::size_t look_ups_ = 0;                 // so far
  std::priority_queue<Square> squares_;      // the most promising on top
  std::priority_queue<Square, std::vector<Square>, std::greater<Square>> kept_;  // the worst on top
};

}  // namespace glass_nav
