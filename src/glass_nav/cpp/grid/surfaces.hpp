/// What lies along one ray: up to three surfaces, what was passed between them, and the mirrored path.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "first_hits.hpp"
#include "fixed_walk.hpp"
#include "grid_walk.hpp"
#include "ray_marching.hpp"
#include "wall_normals.hpp"

namespace glass_nav {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Lengths in cells.
struct SurfaceRules {
  double max_thickness;  // along the normal; a thicker run ends the ray
  double min_linearity;  // below it a cell has no normal
  double min_gap;        // a shorter free gap on the ray does not separate two surfaces
};

struct Surfaces {
  std::array<double, 3> range{kInfinity, kInfinity, kInfinity};
  std::array<std::int32_t, 3> cell{-1, -1, -1};
  std::array<double, 2> thickness{kInfinity, kInfinity};
  WallNormals::Normal normal{std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::quiet_NaN(), 0.0F,
                             std::numeric_limits<float>::quiet_NaN()};  // of the first, towards the origin
  double mirrored = kInfinity;
  std::int32_t mirrored_cell = -1;
};

/// |cos| of the incidence where the first, second and third surface and the mirrored path were met; 1 without a normal.
struct Incidences {
  std::array<double, 3> cos{1.0, 1.0, 1.0};
  double mirrored_cos = 1.0;
};

/// Looks along rays and through what they meet.
template <class Walk, class FirstHits, class RayMarcher>
class SurfaceFinder {
 public:
  /// @param first_hits  finds the first surfaces
  /// @param marcher     finds those behind and beside them
  SurfaceFinder(const GridCells& cells, const FirstHits& first_hits, const RayMarcher& marcher,
                const WallNormals& normals, const SurfaceRules& rules)
      : cells_(cells), first_hits_(first_hits), marcher_(marcher), normals_(normals), rules_(rules) {}

  /// Follows `count` rays of the stream `rays`, each up to t_max(beam) and for the paths of choice(i) only; found(i,
  /// Surfaces, Ray) for each, in any order and without the ray where it meets nothing, or doubtful(DoubtfulRay) where
  /// Walk cannot follow it. All rays go from surface to surface together, since the marcher is fastest with many.
  template <class Rays, class Reach, class Choice, class Found, class Doubt>
  void along_all(std::size_t count, const Reach& t_max, const Choice& choice, Rays& rays, const Found& found,
                 const Doubt& doubtful) const {
    std::vector<std::size_t> meeting;  // the rays that meet something, whose searches and surfaces follow
    std::vector<Search<Walk>> searches;
    std::vector<Surfaces> surfaces;
    std::vector<int> wanted;         // surfaces along each of them
    std::vector<std::size_t> going;  // those of them that are not at their end
    std::vector<std::size_t> mirrored;
    meeting.reserve(count);
    wanted.reserve(count);
    going.reserve(count);
    mirrored.reserve(count);
    searches.reserve(count);
    surfaces.reserve(count);
    const auto hit = [&](std::size_t i, double t, std::int32_t met, const auto& search) {
      if (met < 0) {
        found(i, Surfaces{}, Ray{});
        return;
      }
      searches.push_back(search());
      const WallNormals::Normal normal = facing(normals_.at(met), searches.back().ray);
      const auto paths = choice(i);
      // A beam may miss what has no normal; of a choice of one surface nothing behind matters.
      wanted.push_back(paths.surfaces > 1 && !usable(normal) ? paths.surfaces + 1 : paths.surfaces);
      if (paths.surfaces > 1) going.push_back(meeting.size());
      if (paths.mirrored) mirrored.push_back(meeting.size());
      meeting.push_back(i);
      surfaces.emplace_back();
      surfaces.back().cell[0] = met;
      surfaces.back().range[0] = t;
      surfaces.back().normal = normal;
    };
    first_hits_.along_all(count, t_max, rays, hit, doubtful);
    std::vector<bool> in_doubt(meeting.size());
    mirror(mirrored, searches, surfaces, in_doubt);
    for (std::size_t k = 1; k < 3 && !going.empty(); ++k) {
      pass_surface(k - 1, going, searches, surfaces);
      seek_surface(k, going, searches, surfaces);
      const auto done = [&](std::size_t i) {
        const int found = static_cast<int>(k) + 1;
        return wanted[i] <= found && (k == 2 || usable(normals_.at(surfaces[i].cell[k])));
      };
      going.erase(std::remove_if(going.begin(), going.end(), done), going.end());
    }
    for (std::size_t j = 0; j < meeting.size(); ++j) {
      const Search<Walk>& search = searches[j];
      if (in_doubt[j] || search.walk.is_doubtful()) {
        doubtful(DoubtfulRay{meeting[j], search.ray, search.walk.t_max()});
      } else {
        found(meeting[j], surfaces[j], search.ray);
      }
    }
  }

  /// The incidence at the end of the ray and of its mirrored path.
  Incidences incidences(const Surfaces& at, const Ray& ray) const {
    Incidences result;
    if (at.cell[0] < 0) return result;
    if (usable(at.normal)) result.cos[0] = std::abs(projection(at.normal, ray));
    for (std::size_t k = 1; k < 3; ++k) result.cos[k] = cos_at(at.cell[k], ray);
    if (at.mirrored_cell >= 0) result.mirrored_cos = cos_at(at.mirrored_cell, reflected(ray, 0.0, at.normal));
    return result;
  }

 private:
  /// The line of a wall through one of its cells; with a normal of NaN no cell is on it.
  struct WallLine {
    int width;
    std::int32_t cell;
    double nx, ny;

    bool has(std::int32_t other) const {
      return std::abs(nx * columns_to(other) + ny * rows_to(other)) <= kHalfThickness;
    }
    bool has_nearby(std::int32_t other, int radius) const {
      return std::max(std::abs(columns_to(other)), std::abs(rows_to(other))) <= radius && has(other);
    }

   private:
    static constexpr double kHalfThickness = 1.5;  // cells to either side; a wall drawn one to two cells thick

    int columns_to(std::int32_t other) const { return other % width - cell % width; }
    int rows_to(std::int32_t other) const { return other / width - cell / width; }
  };

  /// Sends the rays on to their surface number k > 0; `going` keeps those that meet one.
  void seek_surface(std::size_t k, std::vector<std::size_t>& going, std::vector<Search<Walk>>& searches,
                    std::vector<Surfaces>& surfaces) const {
    std::vector<WallLine> passed;  // a flat ray would meet the posts and steps of the wall it has passed again
    for (const std::size_t i : going) passed.push_back(wall_line(surfaces[i].cell[k - 1]));
    marcher_.march_all(
        going.size(), [&](std::size_t j) -> const Search<Walk>& { return searches[going[j]]; },
        [&](std::size_t j, std::int32_t cell) { return passed[j].has(cell); },
        [&](std::size_t j, const Walk& walk, std::int32_t met) {
          searches[going[j]].walk = walk;
          surfaces[going[j]].cell[k] = met;
          if (met >= 0) surfaces[going[j]].range[k] = walk.t();
        });
    const auto ended = [&](std::size_t i) { return surfaces[i].cell[k] < 0; };
    going.erase(std::remove_if(going.begin(), going.end(), ended), going.end());
  }

  /// Takes the rays through their surface number k; `going` keeps those that come out.
  void pass_surface(std::size_t k, std::vector<std::size_t>& going, std::vector<Search<Walk>>& searches,
                    std::vector<Surfaces>& surfaces) const {
    const auto ends = [&](std::size_t i) {
      Search<Walk>& search = searches[i];
      const WallNormals::Normal normal =
          k == 0 ? surfaces[i].normal : facing(normals_.at(surfaces[i].cell[k]), search.ray);
      const double cos_incidence = usable(normal) ? -projection(normal, search.ray) : 1.0;
      const double length = pass_run(search.walk, rules_.max_thickness / cos_incidence);
      surfaces[i].thickness[k] = length == kInfinity ? kInfinity : length * cos_incidence;
      return length == kInfinity || !search.walk.inside();
    };
    going.erase(std::remove_if(going.begin(), going.end(), ends), going.end());
  }

  /// Follows the rays mirrored at their first surfaces: along u - 2 (u . n) n.
  void mirror(const std::vector<std::size_t>& hits, const std::vector<Search<Walk>>& searches,
              std::vector<Surfaces>& surfaces, std::vector<bool>& in_doubt) const {
    std::vector<std::size_t> mirrored;
    std::vector<WallLine> mirrors;
    for (const std::size_t i : hits) {
      if (!usable(surfaces[i].normal)) continue;
      mirrored.push_back(i);
      mirrors.push_back({cells_.width, surfaces[i].cell[0], surfaces[i].normal.x, surfaces[i].normal.y});
    }
    marcher_.march_all(
        mirrored.size(),
        [&](std::size_t j) {
          const double t = surfaces[mirrored[j]].range[0];
          const Ray ray = reflected(searches[mirrored[j]].ray, t, surfaces[mirrored[j]].normal);
          const double t_max = searches[mirrored[j]].walk.t_max();
          return Search<Walk>{ray, Walk(ray, cells_.width, cells_.height, t_max - t)};
        },
        // Cells of the mirror itself, within the patch that gave its normal: the staircase of a slanted wall.
        [&](std::size_t j, std::int32_t cell) { return mirrors[j].has_nearby(cell, WallNormals::kRadiusCells); },
        [&](std::size_t j, const Walk& walk, std::int32_t met) {
          Surfaces& at = surfaces[mirrored[j]];
          in_doubt[mirrored[j]] = walk.is_doubtful();
          at.mirrored_cell = met;
          if (met >= 0) at.mirrored = at.range[0] + walk.t();
        });
  }

  double cos_at(std::int32_t cell, const Ray& ray) const {
    if (cell < 0) return 1.0;
    const WallNormals::Normal normal = normals_.at(cell);
    return usable(normal) ? std::abs(projection(normal, ray)) : 1.0;
  }

  WallLine wall_line(std::int32_t cell) const {
    const WallNormals::Normal normal = normals_.at(cell);
    if (!usable(normal)) return {cells_.width, cell, std::nan(""), std::nan("")};
    return {cells_.width, cell, normal.x, normal.y};
  }

  static Ray reflected(const Ray& ray, double t, const WallNormals::Normal& normal) {
    const double into = projection(normal, ray);
    return {ray.x + t * ray.dx, ray.y + t * ray.dy, ray.dx - 2.0 * into * normal.x, ray.dy - 2.0 * into * normal.y};
  }

  bool usable(const WallNormals::Normal& normal) const {
    return normal.linearity > 0.0F && normal.linearity >= rules_.min_linearity;
  }

  static double projection(const WallNormals::Normal& normal, const Ray& ray) {
    return normal.x * ray.dx + normal.y * ray.dy;
  }

  static WallNormals::Normal facing(WallNormals::Normal normal, const Ray& ray) {
    if (projection(normal, ray) <= 0.0) return normal;  // also if it is NaN
    return {-normal.x, -normal.y, normal.linearity, -normal.offset};
  }

  /// Leaves the run of occupied cells in which the walk stands, including gaps too short to count.
  ///
  /// Returns its length along the ray. inf if it is longer than max_length, the ray ends in it, or becomes doubtful.
  double pass_run(Walk& walk, double max_length) const {
    const double min_gap = std::max(rules_.min_gap, GridWalk::kCorner);
    const double t_in = walk.t();
    double t_out = t_in;
    for (;;) {
      const bool occupied = cells_.occupied(walk.cell());
      walk.leap(1);
      if (walk.is_doubtful()) return kInfinity;
      if (occupied) t_out = walk.t();
      if (t_out - t_in > max_length || t_out > walk.t_max()) return kInfinity;
      if (!walk.inside() || walk.t() - t_out >= min_gap) return t_out - t_in;
      if (cells_.met(walk, NothingIgnored{}) >= 0) {
        t_out = walk.t();
      } else if (cells_.stops(walk.cell())) {
        return kInfinity;
      }
    }
  }

  const GridCells& cells_;
  const FirstHits& first_hits_;
  const RayMarcher& marcher_;
  const WallNormals& normals_;
  SurfaceRules rules_;
};

/// A SurfaceFinder that follows all rays in one way, without doubts.
template <class RayMarcher>
class MarchedSurfaceFinder {
 public:
  MarchedSurfaceFinder(const GridCells& cells, const RayMarcher& marcher, const WallNormals& normals,
                       const SurfaceRules& rules)
      : first_hits_(cells, marcher), finder_(cells, first_hits_, marcher, normals, rules) {}
  MarchedSurfaceFinder(const MarchedSurfaceFinder&) = delete;
  MarchedSurfaceFinder& operator=(const MarchedSurfaceFinder&) = delete;

  /// As SurfaceFinder::along_all().
  template <class Rays, class Reach, class Choice, class Found>
  void along_all(std::size_t count, const Reach& t_max, const Choice& choice, Rays& rays, const Found& found) const {
    finder_.along_all(count, t_max, choice, rays, found, [](const DoubtfulRay&) {});
  }

  Incidences incidences(const Surfaces& at, const Ray& ray) const { return finder_.incidences(at, ray); }

 private:
  MarchedFirstHits<RayMarcher> first_hits_;
  SurfaceFinder<GridWalk, MarchedFirstHits<RayMarcher>, RayMarcher> finder_;
};

/// A SurfaceFinder by FixedWalks, and by GridWalks for the few rays that these cannot follow.
class ExactSurfaceFinder {
 public:
  ExactSurfaceFinder(const GridCells& cells, const WallNormals& normals, const SurfaceRules& rules)
      : first_hits_(cells),
        marcher_(cells),
        finder_(cells, first_hits_, marcher_, normals, rules),
        corner_marcher_(cells),
        corner_finder_(cells, corner_marcher_, normals, rules) {}
  ExactSurfaceFinder(const ExactSurfaceFinder&) = delete;
  ExactSurfaceFinder& operator=(const ExactSurfaceFinder&) = delete;

  /// As SurfaceFinder::along_all(); no ray is doubtful.
  template <class Rays, class Reach, class Choice, class Found>
  void along_all(std::size_t count, const Reach& t_max, const Choice& choice, Rays& rays, const Found& found) const {
    std::vector<DoubtfulRay> left;
    finder_.along_all(count, t_max, choice, rays, found, [&](const DoubtfulRay& ray) { left.push_back(ray); });
    ListedRays again{left};
    corner_finder_.along_all(
        left.size(), [&](std::size_t j) { return left[j].t_max; }, [&](std::size_t j) { return choice(left[j].index); },
        again, [&](std::size_t j, const Surfaces& surfaces, const Ray& ray) { found(left[j].index, surfaces, ray); });
  }

  Incidences incidences(const Surfaces& at, const Ray& ray) const { return finder_.incidences(at, ray); }

 private:
  /// A stream of rays that are no beams of a pose: each has its own number.
  struct ListedRays {
    const std::vector<DoubtfulRay>& rays;
    std::size_t number = 0;

    std::size_t beam() const { return number; }
    Ray next() { return rays[number++].ray; }
  };

  FirstHits first_hits_;
  SquareMarcher<FixedWalk> marcher_;
  SurfaceFinder<FixedWalk, FirstHits, SquareMarcher<FixedWalk>> finder_;
  SquareMarcher<GridWalk> corner_marcher_;
  MarchedSurfaceFinder<SquareMarcher<GridWalk>> corner_finder_;
};

}  // namespace glass_nav
