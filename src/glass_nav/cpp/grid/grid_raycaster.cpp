#include "grid_raycaster.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "first_hits.hpp"
#include "ray_stream.hpp"
#include "surfaces.hpp"

namespace glass_nav {
namespace {

/// Deals the batch out in chunks: work(index of the first ray, how many, stream of them).
template <class Work>
void for_each_chunk(const RayBatch& batch, double resolution_m, const Work& work) {
  constexpr std::ptrdiff_t kPoses = 16;
  const Beams beams(batch.angles, batch.angle_count);
  const auto pose_count = static_cast<std::ptrdiff_t>(batch.angle_count > 0 ? batch.pose_count : 0);
#pragma omp parallel for num_threads(batch.threads) if (batch.threads > 1) schedule(dynamic)
  for (std::ptrdiff_t first = 0; first < pose_count; first += kPoses) {
    const std::ptrdiff_t poses = std::min(kPoses, pose_count - first);
    RayStream rays(batch.poses + 3 * first, beams, resolution_m);
    work(static_cast<std::size_t>(first) * beams.count(), static_cast<std::size_t>(poses) * beams.count(), rays);
  }
}

/// Calls work(index, ray) for every ray of the batch, index in the order of the result arrays.
template <class Work>
void for_each_ray(const RayBatch& batch, double resolution_m, const Work& work) {
  for_each_chunk(batch, resolution_m, [&](std::size_t first, std::size_t count, RayStream& rays) {
    for (std::size_t i = 0; i < count; ++i) work(first + i, rays.next());
  });
}

}  // namespace

GridRaycaster::GridRaycaster(const std::int8_t* occupancy, int height, int width, double resolution_m,
                             int occupied_percent, bool unknown_stops, std::shared_ptr<FreeRanges> guide)
    : width_(width),
      height_(height),
      resolution_m_(resolution_m),
      occupied_percent_(occupied_percent),
      unknown_stops_(unknown_stops),
      guide_(std::move(guide)) {
  if (width < 1 || height < 1) throw std::invalid_argument("a grid needs at least one cell");
  if (!(resolution_m > 0.0 && std::isfinite(resolution_m))) throw std::invalid_argument("resolution must be > 0 m");
  const std::int64_t count = static_cast<std::int64_t>(width) * height;
  if (count > std::numeric_limits<std::int32_t>::max())
    throw std::invalid_argument("a grid has at most 2^31 - 1 cells");
  if (unknown_stops) unknown_.resize(static_cast<std::size_t>(count));
  chessboard_distance_ = std::make_unique<ChessboardDistance>(drawn(occupancy, {0, 0, width, height}), width, height);
}

void GridRaycaster::redraw(const std::int8_t* occupancy, const CellBox& box) {
  chessboard_distance_->redraw(box, drawn(occupancy, box));
  if (guide_ != nullptr) guide_->redraw(occupancy, box);
  if (normals_ != nullptr) normals_ = std::make_unique<const WallNormals>(surfaces(), width_, height_, *normals_, box);
}

std::vector<std::uint8_t> GridRaycaster::drawn(const std::int8_t* occupancy, const CellBox& box) {
  std::vector<std::uint8_t> blocked;
  blocked.reserve(static_cast<std::size_t>(box.x1 - box.x0) * (box.y1 - box.y0));
  for (int y = box.y0; y < box.y1; ++y) {
    for (int x = box.x0; x < box.x1; ++x) {
      const std::size_t cell = static_cast<std::size_t>(y) * width_ + x;
      const bool unknown = occupancy[cell] < 0, occupied = !unknown && occupancy[cell] >= occupied_percent_;
      blocked.push_back(occupied || (unknown && unknown_stops_) ? 1 : 0);
      if (unknown_stops_) unknown_[cell] = unknown ? 1 : 0;
    }
  }
  return blocked;
}

std::vector<std::uint8_t> GridRaycaster::surfaces() const {
  const GridCells grid = cells();
  std::vector<std::uint8_t> occupied(static_cast<std::size_t>(width_) * height_);
  for (std::size_t i = 0; i < occupied.size(); ++i) occupied[i] = grid.occupied(static_cast<std::int32_t>(i)) ? 1 : 0;
  return occupied;
}

const WallNormals& GridRaycaster::normals() const {
  std::call_once(normals_once_,
                 [this] { normals_ = std::make_unique<const WallNormals>(surfaces(), width_, height_); });
  return *normals_;
}

GridCells GridRaycaster::cells() const {
  return {width_, height_, chessboard_distance_.get(), unknown_stops_ ? unknown_.data() : nullptr};
}

template <class Use>
void GridRaycaster::with_first_hits(const Use& use) const {
  if (guide_ == nullptr) {
    use(FirstHits(cells()));
  } else {
    const GuidedRayMarcher marcher(cells(), *guide_);
    use(MarchedFirstHits(cells(), marcher));
  }
}

template <class Use>
void GridRaycaster::with_surface_finder(const SurfaceLimits& limits, const Use& use) const {
  const SurfaceRules rules{limits.max_thickness_m / resolution_m_, limits.min_linearity,
                           limits.min_gap_m / resolution_m_};
  const GridCells grid = cells();
  if (guide_ == nullptr) {
    use(ExactSurfaceFinder(grid, normals(), rules));
  } else {
    const GuidedRayMarcher marcher(grid, *guide_);
    use(MarchedSurfaceFinder(grid, marcher, normals(), rules));
  }
}

void GridRaycaster::cast_first(const RayBatch& batch, double* range_m, std::int32_t* cell) const {
  find_first(batch, [t_max = batch.max_range_m / resolution_m_](std::size_t) { return t_max; }, range_m, cell);
}

void GridRaycaster::cast_first(const RayBatch& batch, const double* reach_m, double* range_m,
                               std::int32_t* cell) const {
  find_first(batch, [&](std::size_t beam) { return reach_m[beam] / resolution_m_; }, range_m, cell);
}

template <class Reach>
void GridRaycaster::find_first(const RayBatch& batch, const Reach& t_max, double* range_m, std::int32_t* cell) const {
  with_first_hits([&](const auto& first_hits) {
    for_each_chunk(batch, resolution_m_, [&](std::size_t first, std::size_t count, RayStream& rays) {
      first_hits.along_all(count, t_max, rays, [&](std::size_t i, double t, std::int32_t met, const auto&) {
        range_m[first + i] = met < 0 ? kInfinity : t * resolution_m_;
        if (cell != nullptr) cell[first + i] = met;
      });
    });
  });
}

template <class Reach, class Store>
void GridRaycaster::find_surfaces(const RayBatch& batch, const SurfaceLimits& limits, const Reach& t_max,
                                  const PathChoice* choices, const Store& store) const {
  with_surface_finder(limits, [&](const auto& finder) {
    for_each_chunk(batch, resolution_m_, [&](std::size_t first, std::size_t count, RayStream& rays) {
      constexpr std::size_t kTogether = 512;  // their state fits the level 2 cache
      for (std::size_t done = 0; done < count; done += kTogether) {
        const auto choice = [&](std::size_t i) {
          return choices == nullptr ? PathChoice{} : choices[(first + done + i) % batch.angle_count];
        };
        finder.along_all(
            std::min(kTogether, count - done), t_max, choice, rays,
            [&](std::size_t i, const Surfaces& found, const Ray& ray) { store(first + done + i, finder, found, ray); });
      }
    });
  });
}

void GridRaycaster::cast_surfaces(const RayBatch& batch, const SurfaceLimits& limits, const SurfaceArrays& out) const {
  const auto reach = [t_max = batch.max_range_m / resolution_m_](std::size_t) { return t_max; };
  find_surfaces(batch, limits, reach, nullptr, [&](std::size_t i, const auto&, const Surfaces& found, const Ray&) {
    for (std::size_t k = 0; k < 3; ++k) {
      out.range_m[k][i] = found.range[k] * resolution_m_;
      out.cell[k][i] = found.cell[k];
    }
    for (std::size_t k = 0; k < 2; ++k) out.thickness_m[k][i] = found.thickness[k] * resolution_m_;
    out.normal_rad[i] = std::atan2(found.normal.y, found.normal.x);
    out.linearity[i] = found.normal.linearity;
    out.mirrored_m[i] = found.mirrored * resolution_m_;
    out.mirrored_cell[i] = found.mirrored_cell;
  });
}

void GridRaycaster::cast_paths(const RayBatch& batch, const double* reach_m, const PathChoice* choices,
                               const SurfaceLimits& limits, const PathArrays& out) const {
  const auto reach = [&](std::size_t beam) { return reach_m[beam] / resolution_m_; };
  const auto store = [&](std::size_t i, const auto& finder, const Surfaces& found, const Ray& ray) {
    const Incidences incidences = finder.incidences(found, ray);
    constexpr std::size_t kMirrored = 1;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t path = k == 0 ? 0 : k + 1;
      out.range_m[path][i] = found.range[k] * resolution_m_;
      out.cos[path][i] = incidences.cos[k];
      out.cell[path][i] = found.cell[k];
    }
    out.range_m[kMirrored][i] = found.mirrored * resolution_m_;
    out.cos[kMirrored][i] = incidences.mirrored_cos;
    out.cell[kMirrored][i] = found.mirrored_cell;
  };
  find_surfaces(batch, limits, reach, choices, store);
}

void GridRaycaster::free_ranges(const FreeRanges& rays, const RayBatch& batch, double* range_m) const {
  const double t_max = batch.max_range_m / resolution_m_;
  for_each_ray(batch, resolution_m_,
               [&](std::size_t i, const Ray& ray) { range_m[i] = rays.along(ray, 0.0, t_max) * resolution_m_; });
}

}  // namespace glass_nav
