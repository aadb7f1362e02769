/// The first occupied cell on each of many rays: the fast path for the plain case.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "fixed_walk.hpp"
#include "grid_walk.hpp"
#include "ray_marching.hpp"

namespace glass_nav {

/// A ray that a FixedWalk could not follow.
struct DoubtfulRay {
  std::size_t index;
  Ray ray;
  double t_max;
};

/// Skips ahead as SquareMarcher does, for many rays that start from few places.
class FirstHits {
 public:
  explicit FirstHits(const GridCells& cells) : cells_(cells) {}

  /// @param t_max     t_max(beam): how far to follow a ray
  /// @param rays      next() and at_new_origin(), see RayStream
  /// @param found     found(i, t, cell, search): for i < count, in any order; cell -1: nothing up to t_max; search():
  /// the
  ///                  Search with which to go on from a cell
  /// @param doubtful  doubtful(DoubtfulRay): for every other i
  template <class Reach, class Rays, class Found, class Doubt>
  void along_all(std::size_t count, const Reach& t_max, Rays& rays, const Found& found, const Doubt& doubtful) const {
    std::array<Lane, kLanes> lanes;  // several rays at a time, for the reasons of SquareMarcher
    FixedWalk::Origin origin;
    std::size_t next = 0, busy = 0;
    const auto fill = [&](Lane& lane) {  // false if no ray is left
      while (next < count) {
        const bool moved = next == 0 || rays.at_new_origin();
        const double reach = t_max(rays.beam());
        const Ray ray = rays.next();
        if (moved) origin = {ray.x, ray.y, cells_.width, cells_.height};
        const std::size_t i = next++;
        if (origin.is_plain) {
          lane.walk = {origin, ray, cells_.width, cells_.height, reach};
          lane.free_square = cells_.chessboard_distance->towards(lane.walk.minus_x(), lane.walk.minus_y());
          lane.index = i;
          lane.ray = ray;
          return true;
        }
        doubtful(DoubtfulRay{i, ray, reach});
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
          doubtful(DoubtfulRay{lane.index, lane.ray, lane.walk.t_max()});
        } else {
          const std::int32_t met = step == Step::hit ? lane.walk.cell() : -1;
          found(lane.index, lane.walk.t(), met, [&] { return Search<FixedWalk>{lane.ray, lane.walk}; });
        }
        if (!fill(lane)) lane = lanes[--busy];  // it is processed in the next round
      }
    }
  }

  /// The same, with every ray found.
  template <class Reach, class Rays, class Found>
  void along_all(std::size_t count, const Reach& t_max, Rays& rays, const Found& found) const {
    std::vector<DoubtfulRay> left;
    along_all(count, t_max, rays, found, [&](const DoubtfulRay& ray) { left.push_back(ray); });
    const auto start = [&](std::size_t j) {
      return Search<GridWalk>{left[j].ray, GridWalk(left[j].ray, cells_.width, cells_.height, left[j].t_max)};
    };
    SquareMarcher<GridWalk>(cells_).march_all(
        left.size(), start, NothingIgnored{}, [&](std::size_t j, const GridWalk& walk, std::int32_t met) {
          found(left[j].index, walk.t(), met, [&] { return Search<GridWalk>{left[j].ray, walk}; });
        });
  }

 private:
  static constexpr std::size_t kLanes = 24;

  enum class Step { on, hit, end, doubt };

  struct Lane {
    FixedWalk walk;
    const std::uint8_t* free_square;
    std::size_t index;
    Ray ray;
  };

  /// Checks the present cell and skips ahead.
  Step advance(Lane& lane) const {
    const int edge = lane.free_square[lane.walk.cell()];
    if (edge == 0) return cells_.occupied(lane.walk.cell()) ? Step::hit : Step::end;
    lane.walk.leap(edge);
    if (lane.walk.is_doubtful()) return Step::doubt;
    if (!lane.walk.inside()) return Step::end;
    __builtin_prefetch(lane.free_square + lane.walk.cell());
    return Step::on;
  }

  GridCells cells_;
};

/// The first hits that a ray marcher finds, one like the other.
template <class RayMarcher>
class MarchedFirstHits {
 public:
  MarchedFirstHits(const GridCells& cells, const RayMarcher& marcher) : cells_(cells), marcher_(marcher) {}

  /// As FirstHits::along_all(); no ray is doubtful.
  template <class Reach, class Rays, class Found, class Doubt>
  void along_all(std::size_t count, const Reach& t_max, Rays& rays, const Found& found, const Doubt&) const {
    along_all(count, t_max, rays, found);
  }

  template <class Reach, class Rays, class Found>
  void along_all(std::size_t count, const Reach& t_max, Rays& rays, const Found& found) const {
    std::vector<Ray> started;
    started.reserve(count);
    const auto start = [&](std::size_t) {
      const double reach = t_max(rays.beam());
      started.push_back(rays.next());
      return Search<GridWalk>{started.back(), GridWalk(started.back(), cells_.width, cells_.height, reach)};
    };
    marcher_.march_all(count, start, NothingIgnored{}, [&](std::size_t i, const GridWalk& walk, std::int32_t met) {
      found(i, walk.t(), met, [&] { return Search<GridWalk>{started[i], walk}; });
    });
  }

 private:
  GridCells cells_;
  const RayMarcher& marcher_;
};

}  // namespace glass_nav
