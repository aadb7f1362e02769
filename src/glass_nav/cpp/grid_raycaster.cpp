#include "grid_raycaster.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

#include "distance_field.hpp"
#include "seekers.hpp"
#include "surfaces.hpp"

namespace glass_nav {
namespace {

/// Calls work(index, ray) for every ray of the batch, index in the order of the result arrays.
template <class Work>
void for_each_ray(const RayBatch& batch, double resolution_m, const Work& work) {
  // One sine and cosine for each pose and each beam; their sums come by rotation.
  std::vector<double> beam_x(batch.angle_count), beam_y(batch.angle_count);
  for (std::size_t b = 0; b < batch.angle_count; ++b) {
    beam_x[b] = std::cos(batch.angles[b]);
    beam_y[b] = std::sin(batch.angles[b]);
  }
  const auto pose_count = static_cast<std::ptrdiff_t>(batch.pose_count);
#pragma omp parallel for num_threads(batch.threads) if (batch.threads > 1) schedule(dynamic, 8)
  for (std::ptrdiff_t p = 0; p < pose_count; ++p) {
    const double* pose = batch.poses + 3 * p;
    const double cos_yaw = std::cos(pose[2]), sin_yaw = std::sin(pose[2]);
    Ray ray{pose[0] / resolution_m, pose[1] / resolution_m, 0.0, 0.0};
    for (std::size_t b = 0; b < batch.angle_count; ++b) {
      ray.dx = cos_yaw * beam_x[b] - sin_yaw * beam_y[b];
      ray.dy = sin_yaw * beam_x[b] + cos_yaw * beam_y[b];
      work(static_cast<std::size_t>(p) * batch.angle_count + b, ray);
    }
  }
}

constexpr float kFree = 1.0F, kUnknown = 0.5F, kOccupied = 0.0F;  // MRPT keeps the probability of being free

}  // namespace

Backend backend_from_name(const std::string& name) {
  if (name == "exact") return Backend::exact;
  if (name == "mrpt") return Backend::mrpt;
  throw std::invalid_argument("backend must be 'exact' or 'mrpt', got '" + name + "'");
}

GridRaycaster::GridRaycaster(const std::int8_t* occupancy, int height, int width, double resolution_m,
                             int occupied_percent, Backend backend, bool unknown_stops)
    : width_(width), height_(height), resolution_m_(resolution_m), backend_(backend) {
  if (width < 1 || height < 1) throw std::invalid_argument("a grid needs at least one cell");
  if (!(resolution_m > 0.0 && std::isfinite(resolution_m))) throw std::invalid_argument("resolution must be > 0 m");
  const std::int64_t count = static_cast<std::int64_t>(width) * height;
  if (count > std::numeric_limits<std::int32_t>::max()) throw std::invalid_argument("a grid has at most 2^31 - 1 cells");
  // At the origin: setSize() would round any other place to whole cells.
  map_.setSize(0.0F, static_cast<float>(width * resolution_m), 0.0F, static_cast<float>(height * resolution_m),
               static_cast<float>(resolution_m));
  if (map_.getSizeX() != static_cast<unsigned>(width) || map_.getSizeY() != static_cast<unsigned>(height)) {
    throw std::invalid_argument("MRPT made " + std::to_string(map_.getSizeX()) + " x " +
                                std::to_string(map_.getSizeY()) + " cells of a grid of " + std::to_string(width) +
                                " x " + std::to_string(height));
  }
  occupied_.resize(count);
  std::vector<std::uint8_t> blocked(count);
  for (std::int64_t cell = 0; cell < count; ++cell) {
    const bool unknown = occupancy[cell] < 0;
    occupied_[cell] = !unknown && occupancy[cell] >= occupied_percent ? 1 : 0;
    blocked[cell] = occupied_[cell] != 0 || (unknown && unknown_stops) ? 1 : 0;
    map_.setCell(static_cast<int>(cell % width), static_cast<int>(cell / width),
                 occupied_[cell] != 0 ? kOccupied : (unknown ? kUnknown : kFree));
  }
  distance_ = chessboard_distance(blocked, width, height);
}

const WallNormals& GridRaycaster::normals() const {
  std::call_once(normals_once_,
                 [this] { normals_ = std::make_unique<const WallNormals>(occupied_, width_, height_); });
  return *normals_;
}

template <class Use>
void GridRaycaster::with_seeker(const Use& use) const {
  const GridCells cells{width_, height_, distance_.data(), occupied_.data()};
  if (backend_ == Backend::exact) {
    use(cells, ExactSeeker(cells));
  } else {
    use(cells, MrptSeeker(cells, map_, resolution_m_));
  }
}

void GridRaycaster::cast_first(const RayBatch& rays, double* range_m, std::int32_t* cell) const {
  const double t_max = rays.max_range_m / resolution_m_;
  with_seeker([&](const GridCells& cells, const auto& seeker) {
    for_each_ray(rays, resolution_m_, [&](std::size_t i, const Ray& ray) {
      GridWalk walk(ray, cells.width, cells.height, t_max);
      const std::int32_t met = seeker.seek(ray, walk, NothingIgnored{});
      range_m[i] = met < 0 ? kInfinity : walk.t() * resolution_m_;
      if (cell != nullptr) cell[i] = met;
    });
  });
}

void GridRaycaster::cast_surfaces(const RayBatch& rays, const SurfaceLimits& limits,
                                  const SurfaceArrays& out) const {
  const double t_max = rays.max_range_m / resolution_m_;
  const SurfaceRules rules{limits.max_thickness_m / resolution_m_, limits.min_linearity,
                           limits.min_gap_m / resolution_m_};
  const WallNormals& wall_normals = normals();  // before the threads start
  with_seeker([&](const GridCells& cells, const auto& seeker) {
    const SurfaceFinder finder(cells, seeker, wall_normals, rules);
    for_each_ray(rays, resolution_m_, [&](std::size_t i, const Ray& ray) {
      const Surfaces found = finder.along(ray, t_max);
      for (std::size_t k = 0; k < 3; ++k) {
        out.range_m[k][i] = found.range[k] * resolution_m_;
        out.cell[k][i] = found.cell[k];
      }
      for (std::size_t k = 0; k < 2; ++k) out.thickness_m[k][i] = found.thickness[k] * resolution_m_;
      out.normal_rad[i] = found.normal.angle_rad;
      out.linearity[i] = found.normal.linearity;
      out.mirrored_m[i] = found.mirrored * resolution_m_;
    });
  });
}

void GridRaycaster::simulate_scan_ray_raw(const RayBatch& rays, double* range_m) const {
  const GridCells cells{width_, height_, distance_.data(), occupied_.data()};
  const MrptSeeker seeker(cells, map_, resolution_m_);
  const double t_max = rays.max_range_m / resolution_m_;
  for_each_ray(rays, resolution_m_, [&](std::size_t i, const Ray& ray) {
    range_m[i] = seeker.free_cells(ray, 0.0, t_max) * resolution_m_;
  });
}

}  // namespace glass_nav
