/// Casts rays on an occupancy grid.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "chessboard_distance.hpp"
#include "free_ranges.hpp"
#include "ray_marching.hpp"
#include "wall_normals.hpp"

namespace glass_nav {

/// A batch of rays: every pose looks along every angle. Row-major arrays, owned by the caller.
struct RayBatch {
  const double* poses;  // pose_count * 3: x [m], y [m], yaw [rad] in the frame of the grid
  std::size_t pose_count;
  const double* angles;  // angle_count: directions in the frame of the pose [rad]
  std::size_t angle_count;
  double max_range_m;
  int threads;  // 1: the caller's thread, no OpenMP
};

/// What counts as one surface, and where it ends.
struct SurfaceLimits {
  double max_thickness_m;  // along the normal; a thicker run ends the ray
  double min_linearity;    // below it a cell has no normal
  double min_gap_m;        // a shorter free gap on the ray does not separate two surfaces
};

/// Which of the paths along a ray are looked for.
struct PathChoice {
  int surfaces = 3;      // so many with a normal, the nearest first, at most 3 in all
  bool mirrored = true;  // the path mirrored at the first one
};

/// Where the results of cast_surfaces go: arrays of pose_count * angle_count.
struct SurfaceArrays {
  double* range_m[3];           // first, second, third surface; inf where none
  std::int32_t* cell[3];        // -1 where none
  double* thickness_m[2];       // of the first and the second; inf where the ray was not followed through
  double* normal_rad;           // of the first, facing the origin of the ray; NaN where none
  double* linearity;            // of the first
  double* mirrored_m;           // path mirrored at the first surface; inf where none
  std::int32_t* mirrored_cell;  // where that ends; -1 where none
};

/// Where the results of cast_paths go: arrays of pose_count * angle_count for each path that a beam may take: to the
/// first surface, mirrored there, and to the second and third.
struct PathArrays {
  double* range_m[4];     // whole length; inf where none
  double* cos[4];         // of the incidence where it ends; 1 without a normal
  std::int32_t* cell[4];  // where it ends; -1 where none
};

/// An occupancy grid and the rays on it. Frame of the grid: cell [0, 0] starts at (0, 0), no rotation.
class GridRaycaster {
 public:
  /// @param occupancy  height * width, row by row, 0 .. 100 percent or -1 unknown
  /// @param occupied_percent  a cell this occupied ends a beam
  /// @param unknown_stops  a ray ends, without a hit, at the first unknown cell; otherwise it passes
  /// @param guide  says where to look for surfaces; null: rays skip from free square to free square
  GridRaycaster(const std::int8_t* occupancy, int height, int width, double resolution_m, int occupied_percent,
                bool unknown_stops, std::shared_ptr<FreeRanges> guide);

  /// Cells in a box have changed. Not while another thread casts rays.
  /// @param occupancy  of the whole grid, as for the constructor
  void redraw(const std::int8_t* occupancy, const CellBox& box);

  int width() const { return width_; }
  int height() const { return height_; }
  double resolution_m() const { return resolution_m_; }

  /// First occupied cell along every ray: range_m inf and cell -1 where there is none. `cell` may be null.
  void cast_first(const RayBatch& batch, double* range_m, std::int32_t* cell) const;

  /// The same; beam b is followed up to reach_m[b].
  void cast_first(const RayBatch& batch, const double* reach_m, double* range_m, std::int32_t* cell) const;

  /// First, second and third surface along every ray, with what lies between.
  void cast_surfaces(const RayBatch& batch, const SurfaceLimits& limits, const SurfaceArrays& out) const;

  /// The same for comparison with measured ranges, without what lies between; beam b is followed up to reach_m[b].
  /// @param choices  of each beam; null: all paths are looked for
  void cast_paths(const RayBatch& batch, const double* reach_m, const PathChoice* choices, const SurfaceLimits& limits,
                  const PathArrays& out) const;

  /// What the rays of another library answer up to max_range_m, unchecked: for comparison only.
  void free_ranges(const FreeRanges& rays, const RayBatch& batch, double* range_m) const;

  /// Computed when first asked for; any thread may ask.
  const WallNormals& normals() const;

 private:
  GridCells cells() const;
  template <class Use>
  void with_first_hits(const Use& use) const;
  template <class Use>
  void with_surface_finder(const SurfaceLimits& limits, const Use& use) const;
  template <class Reach>
  void find_first(const RayBatch& batch, const Reach& t_max, double* range_m, std::int32_t* cell) const;
  template <class Reach, class Store>
  void find_surfaces(const RayBatch& batch, const SurfaceLimits& limits, const Reach& t_max, const PathChoice* choices,
                     const Store& store) const;

  /// Keeps which cells of a box are unknown, if those stop rays; which of its cells end a ray, row by row.
  std::vector<std::uint8_t> drawn(const std::int8_t* occupancy, const CellBox& box);
  std::vector<std::uint8_t> surfaces() const;  // of each cell, not 0: occupied

  int width_, height_;
  double resolution_m_;
  int occupied_percent_;
  bool unknown_stops_;
  std::shared_ptr<FreeRanges> guide_;
  std::vector<std::uint8_t> unknown_;  // of each cell, not 0: unknown; empty unless those stop rays
  std::unique_ptr<ChessboardDistance> chessboard_distance_;  // between the cells where a ray may end
  mutable std::once_flag normals_once_;
  mutable std::unique_ptr<const WallNormals> normals_;
};

}  // namespace glass_nav
