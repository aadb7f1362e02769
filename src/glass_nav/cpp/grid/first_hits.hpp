/// The first occupied cell on each of many rays: the fast path for the plain case.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "grid_walk.hpp"
#include "ray_marching.hpp"

namespace glass_nav {

/// Skips ahead as ExactRayMarcher does, with the same result to the last bit but a fraction of the arithmetic and
/// state.
///
/// It handles only the clear case: rays that start in the grid and pass no corner between cells. A ray that crosses two
/// grid lines within a ten-millionth of a cell starts again as a GridWalk, which handles corners.
///
/// Coordinates are fixed-point numbers with kPointBits fractional bits: the integer part is the cell, the fraction
/// tells whether a grid line is near. They are kNudge too large, so that a coordinate that has just crossed a line is
/// always beyond it, whatever the rounding.
class FirstHits {
 public:
  explicit FirstHits(const GridCells& cells)
      : cells_(cells), marcher_(cells), small_(std::max(cells.width, cells.height) <= kMostCells) {}

  /// @param t_max  t_max(beam): how far to follow a ray
  /// @param rays   next() and at_new_origin(), see RayStream
  /// @param found  found(i, t, cell, search): once for every i < count, in any order; cell -1: nothing up to t_max;
  ///               search(): the Search with which to go on from a cell
  template <class Reach, class Rays, class Found>
  void along_all(std::size_t count, const Reach& t_max, Rays& rays, const Found& found) const {
    std::array<Lane, kLanes> lanes;  // several rays at a time, for the reasons of ExactRayMarcher
    std::vector<Doubtful> doubtful;
    Origin origin;
    std::size_t next = 0, busy = 0;
    const auto fill = [&](Lane& lane) {  // false if no ray is left
      while (next < count) {
        const bool moved = next == 0 || rays.at_new_origin();
        const double reach = t_max(rays.beam());
        const Ray ray = rays.next();
        if (moved) origin = origin_of(ray);
        const std::size_t i = next++;
        if (origin.plain) {
          begin(lane, origin, ray, reach, i);
          return true;
        }
        doubtful.push_back({ray, reach, i});
      }
      return false;
    };
    while (busy < kLanes && fill(lanes[busy])) ++busy;
    while (busy > 0) {
      for (std::size_t k = 0; k < busy; ++k) {
        Lane& lane = lanes[k];
        const Step step = advance(lane);
        if (step == Step::on) continue;
        if (step == Step::doubt) {
          doubtful.push_back({lane.ray, lane.t_max, lane.index});
        } else {
          const std::int32_t met = step == Step::hit ? static_cast<std::int32_t>(lane.cell) : -1;
          found(lane.index, lane.t, met, [&] { return search_from(lane); });
        }
        if (!fill(lane)) lane = lanes[--busy];  // it is processed in the next round
      }
    }
    decide(doubtful, found);
  }

 private:
  static constexpr std::size_t kLanes = 24;
  static constexpr int kPointBits = 32;
  static constexpr double kPoint = 4294967296.0;  // 2^kPointBits: multiplying by it rounds nothing
  static constexpr std::int64_t kNudge = 512;     // 1.2e-7 cells: a hundred times GridWalk::kCorner
  static constexpr int kMostCells = 1 << 20;      // along an edge of the grid; up to here rounding is far below kNudge

  enum class Step { on, hit, end, doubt };

  struct Doubtful {
    Ray ray;
    double t_max;
    std::size_t index;
  };

  /// One coordinate of an origin: as it is for rays towards +, mirrored for those towards -.
  struct AxisOrigin {
    AxisOrigin() = default;
    AxisOrigin(double origin, int size)
        : start{origin, size - origin}, cell{static_cast<int>(origin), size - 1 - static_cast<int>(origin)} {}

    std::array<double, 2> start{};
    std::array<std::int64_t, 2> cell{};
  };

  struct Origin {
    AxisOrigin x, y;
    bool plain = false;  // otherwise GridWalk follows the rays from here
  };

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

  struct Lane {
    Axis x, y;
    double t;  // where the ray entered the present cell
    double t_max;
    const std::uint8_t* free_square;
    std::ptrdiff_t cell;                    // flat index of the present cell
    std::ptrdiff_t cell_0, step_x, step_y;  // that of the cell which is (0, 0) after mirroring, and steps from it
    std::size_t index;
    Ray ray;
  };

  static bool turned(double direction) { return direction <= -GridWalk::kAxisParallel; }

  Origin origin_of(const Ray& ray) const {
    const bool inside = ray.x >= 0.0 && ray.y >= 0.0 && ray.x < cells_.width && ray.y < cells_.height;
    if (!small_ || !inside) return {};
    return {{ray.x, cells_.width}, {ray.y, cells_.height}, true};
  }

  void begin(Lane& lane, const Origin& origin, const Ray& ray, double t_max, std::size_t index) const {
    const std::ptrdiff_t width = cells_.width, height = cells_.height;
    const bool minus_x = turned(ray.dx), minus_y = turned(ray.dy);
    lane.x.begin(origin.x, ray.dx, minus_x);
    lane.y.begin(origin.y, ray.dy, minus_y);
    lane.t = 0.0;
    lane.t_max = t_max;
    lane.free_square = cells_.chessboard_distance->towards(minus_x, minus_y);
    lane.cell = origin.y.cell[0] * width + origin.x.cell[0];
    // Products, not branches: the signs of directions are unpredictable.
    lane.cell_0 = minus_x * (width - 1) + minus_y * (height - 1) * width;
    lane.step_x = 1 - 2 * minus_x;
    lane.step_y = (1 - 2 * minus_y) * width;
    lane.index = index;
    lane.ray = ray;
  }

  /// Checks the present cell and skips ahead.
  Step advance(Lane& lane) const {
    const int edge = lane.free_square[lane.cell];
    if (edge == 0) return cells_.occupied(static_cast<std::int32_t>(lane.cell)) ? Step::hit : Step::end;
    lane.t = std::min(lane.x.crossing(edge), lane.y.crossing(edge));
    const std::int64_t x = lane.x.fixed(lane.t), y = lane.y.fixed(lane.t);
    // The coordinate that crosses its line is now kNudge beyond it. A corner is near if the other one is no more than
    // twice that beyond a line too, that is, kNudge before or behind it without the nudge.
    if (static_cast<std::uint32_t>(x | y) < 2 * kNudge) return Step::doubt;
    lane.x.cell = x >> kPointBits;
    lane.y.cell = y >> kPointBits;
    if (lane.t > lane.t_max || lane.x.cell >= cells_.width || lane.y.cell >= cells_.height) return Step::end;
    lane.cell = lane.cell_0 + lane.x.cell * lane.step_x + lane.y.cell * lane.step_y;
    __builtin_prefetch(lane.free_square + lane.cell);
    return Step::on;
  }

  Search search_from(const Lane& lane) const {
    GridWalk walk(lane.ray, cells_.width, cells_.height, lane.t_max);
    walk.skip_to(static_cast<int>(lane.x.cell), static_cast<int>(lane.y.cell), lane.t);
    return {lane.ray, walk};
  }

  /// Casts the rays that are not plain, from their origins on.
  template <class Found>
  void decide(const std::vector<Doubtful>& doubtful, const Found& found) const {
    const auto start = [&](std::size_t j) {
      return Search{doubtful[j].ray, GridWalk(doubtful[j].ray, cells_.width, cells_.height, doubtful[j].t_max)};
    };
    marcher_.march_all(doubtful.size(), start, NothingIgnored{},
                       [&](std::size_t j, const GridWalk& walk, std::int32_t met) {
                         found(doubtful[j].index, walk.t(), met, [&] { return Search{doubtful[j].ray, walk}; });
                       });
  }

  GridCells cells_;
  ExactRayMarcher marcher_;
  bool small_;
};

/// The first hits that a ray marcher finds, one like the other.
template <class RayMarcher>
class MarchedFirstHits {
 public:
  MarchedFirstHits(const GridCells& cells, const RayMarcher& marcher) : cells_(cells), marcher_(marcher) {}

  /// As FirstHits::along_all.
  template <class Reach, class Rays, class Found>
  void along_all(std::size_t count, const Reach& t_max, Rays& rays, const Found& found) const {
    std::vector<Ray> started;
    started.reserve(count);
    const auto start = [&](std::size_t) {
      const double reach = t_max(rays.beam());
      started.push_back(rays.next());
      return Search{started.back(), GridWalk(started.back(), cells_.width, cells_.height, reach)};
    };
    marcher_.march_all(count, start, NothingIgnored{}, [&](std::size_t i, const GridWalk& walk, std::int32_t met) {
      found(i, walk.t(), met, [&] { return Search{started[i], walk}; });
    });
  }

 private:
  GridCells cells_;
  const RayMarcher& marcher_;
};

}  // namespace glass_nav
