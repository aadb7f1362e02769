/// Two ways to find the next occupied cell on a ray.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "chessboard_distance.hpp"
#include "fixed_walk.hpp"
#include "free_ranges.hpp"
#include "grid_walk.hpp"

namespace glass_nav {

/// The cells as rays see them; all arrays are row-major and belong to the raycaster.
struct GridCells {
  int width, height;
  const ChessboardDistance* chessboard_distance;  // to the cells that end a ray
  const std::uint8_t* unknown;                    // not 0: ends a ray without being a surface; null: no cell does

  /// A surface.
  bool occupied(std::int32_t cell) const { return blocked(cell) && (unknown == nullptr || unknown[cell] == 0); }

  /// A cell that ends a ray without being a surface.
  bool stops(std::int32_t cell) const { return unknown != nullptr && blocked(cell) && unknown[cell] != 0; }

  bool blocked(std::int32_t cell) const { return chessboard_distance->towards(false, false)[cell] == 0; }

  /// The occupied cell that the ray meets at the present step: its own or one beside the corner; -1 none. Where the
  /// ray leaves the grid at a corner there is still one beside it.
  template <class Ignored>
  std::int32_t met(const GridWalk& walk, const Ignored& ignored) const {
    if (walk.t() > walk.t_max()) return -1;
    if (walk.inside() && occupied(walk.cell()) && !ignored(walk.cell())) return walk.cell();
    const std::int32_t beside = walk.cell_beside_corner();
    return beside >= 0 && occupied(beside) && !ignored(beside) ? beside : -1;
  }

  /// The same of a walk that passes no corner.
  template <class Ignored>
  std::int32_t met(const FixedWalk& walk, const Ignored& ignored) const {
    return walk.inside() && occupied(walk.cell()) && !ignored(walk.cell()) ? walk.cell() : -1;
  }
};

/// A ray and how far it has been followed.
template <class Walk>
struct Search {
  Ray ray;
  Walk walk;
};

/// For rays that ignore no occupied cell.
struct NothingIgnored {
  bool operator()(std::int32_t) const { return false; }
  bool operator()(std::size_t, std::int32_t) const { return false; }
};

/// Skips from free square to free square; exact.
template <class Walk>
class SquareMarcher {
 public:
  explicit SquareMarcher(const GridCells& cells) : cells_(cells) {}

  /// Walks on along many rays, each to the next occupied cell that is not ignored.
  ///
  /// Several at a time: while one waits for its next cell to come from memory, the others go on. For scattered poses
  /// this takes half as long as one ray after the other.
  ///
  /// @param start    start(i), called once for every i < count in order: the Search to go on with
  /// @param ignored  ignored(i, cell): cells that ray i passes
  /// @param found    found(i, walk, cell): where that walk ended, and the cell it met; -1 if the ray ends before one,
  /// or
  ///                 the walk has become doubtful
  template <class Start, class Ignored, class Found>
  void march_all(std::size_t count, const Start& start, const Ignored& ignored, const Found& found) const {
    std::array<Lane, kLanes> lanes;
    std::size_t next = 0, busy = 0;
    const auto fill = [&](Lane& lane) {  // false if no ray is left
      while (next < count) {
        lane.walk = start(next).walk;
        lane.ray = next++;
        if (!lane.walk.is_doubtful()) {
          lane.free_square = cells_.chessboard_distance->towards(lane.walk.minus_x(), lane.walk.minus_y());
          return true;
        }
        found(lane.ray, lane.walk, -1);
      }
      return false;
    };
    while (busy < kLanes && fill(lanes[busy])) ++busy;
    while (busy > 0) {
      for (std::size_t i = 0; i < busy; ++i) {
        Lane& lane = lanes[i];
        const std::int32_t met =
            step(lane.walk, lane.free_square, [&](std::int32_t cell) { return ignored(lane.ray, cell); });
        if (met == kContinues) continue;
        found(lane.ray, lane.walk, met);
        if (!fill(lane)) lane = lanes[--busy];  // it is processed in the next round
      }
    }
  }

 private:
  static constexpr std::int32_t kContinues = -2;
  static constexpr std::size_t kLanes = 16;

  struct Lane {
    Walk walk;
    const std::uint8_t* free_square = nullptr;
    std::size_t ray = 0;
  };

  /// Checks the present cell and skips ahead. Returns the cell met, -1 where the ray ends, or kContinues.
  template <class Ignored>
  std::int32_t step(Walk& walk, const std::uint8_t* free_square, const Ignored& ignored) const {
    if (!walk.inside()) return cells_.met(walk, ignored);
    const int edge = free_square[walk.cell()];
    if (edge == 0 || walk.near_corner()) {
      const std::int32_t met = cells_.met(walk, ignored);
      if (met >= 0) return met;
      if (cells_.stops(walk.cell())) return -1;
    }
    walk.leap(std::max(edge, 1));
    if (walk.is_doubtful()) return -1;
    __builtin_prefetch(free_square + walk.cell());  // may lie outside: a prefetch does not fault
    return kContinues;
  }

  GridCells cells_;
};

/// Asks another library how far each ray is free, then checks the cells on the path itself: the answer may be late, and
/// may be wrong about what it passed or met.
class GuidedRayMarcher {
 public:
  GuidedRayMarcher(const GridCells& cells, const FreeRanges& guide) : cells_(cells), guide_(guide) {}

  /// As SquareMarcher::march_all, one ray after the other.
  template <class Start, class Ignored, class Found>
  void march_all(std::size_t count, const Start& start, const Ignored& ignored, const Found& found) const {
    for (std::size_t i = 0; i < count; ++i) {
      Search<GridWalk> search = start(i);
      const auto passes = [&](std::int32_t cell) { return ignored(i, cell); };
      const std::int32_t met = seek(search.ray, search.walk, passes);
      found(i, search.walk, met);
    }
  }

 private:
  template <class Ignored>
  std::int32_t seek(const Ray& ray, GridWalk& walk, const Ignored& ignored) const {
    while (walk.inside()) {
      const double look_until = walk.t() + guide_.along(ray, walk.t(), walk.t_max()) + kMarginCells;
      for (; walk.inside() && walk.t() <= look_until; walk.leap(1)) {
        const std::int32_t met = cells_.met(walk, ignored);
        if (met >= 0) return met;
        if (cells_.stops(walk.cell())) return -1;
      }
    }
    return cells_.met(walk, ignored);
  }

  static constexpr double kMarginCells = 2.0;  // the guide reports a sample before or after the boundary

  GridCells cells_;
  const FreeRanges& guide_;
};

}  // namespace glass_nav
