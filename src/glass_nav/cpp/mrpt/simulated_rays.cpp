#include "simulated_rays.hpp"

#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>

namespace glass_nav {
namespace {

constexpr float kFree = 1.0F, kUnknown = 0.5F, kOccupied = 0.0F;  // MRPT keeps the probability of being free
constexpr float kPassFrom = 0.4F;   // a cell that is free with at least this probability lets a ray pass
constexpr double kStepCells = 0.8;  // of simulateScanRay

}  // namespace

SimulatedRays::SimulatedRays(const std::int8_t* occupancy, int height, int width, double resolution_m,
                             int occupied_percent)
    : width_(width), resolution_m_(resolution_m), occupied_percent_(occupied_percent) {
  // At the origin: setSize() would round any other place to whole cells.
  map_.setSize(0.0F, static_cast<float>(width * resolution_m), 0.0F, static_cast<float>(height * resolution_m),
               static_cast<float>(resolution_m));
  if (map_.getSizeX() != static_cast<unsigned>(width) || map_.getSizeY() != static_cast<unsigned>(height)) {
    throw std::invalid_argument("MRPT made " + std::to_string(map_.getSizeX()) + " x " +
                                std::to_string(map_.getSizeY()) + " cells of a grid of " + std::to_string(width) +
                                " x " + std::to_string(height));
  }
  redraw(occupancy, {0, 0, width, height});
}

double SimulatedRays::along(const Ray& ray, double t, double t_max) const {
  float range_m = 0.0F;
  bool valid = false;
  map_.simulateScanRay((ray.x + t * ray.dx) * resolution_m_, (ray.y + t * ray.dy) * resolution_m_,
                       std::atan2(ray.dy, ray.dx), range_m, valid, (t_max - t) * resolution_m_ / kStepCells, kPassFrom);
  return valid ? range_m / resolution_m_ : std::numeric_limits<double>::infinity();
}

void SimulatedRays::redraw(const std::int8_t* occupancy, const CellBox& box) {
  for (int y = box.y0; y < box.y1; ++y) {
    for (int x = box.x0; x < box.x1; ++x) {
      const std::int8_t percent = occupancy[static_cast<std::size_t>(y) * width_ + x];
      map_.setCell(x, y, percent < 0 ? kUnknown : percent >= occupied_percent_ ? kOccupied : kFree);
    }
  }
}

}  // namespace glass_nav
