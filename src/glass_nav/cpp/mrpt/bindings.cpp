/// The Python module _mrpt_rays. Private: its face is sensing/raycast.py. Apart from _grid, because MRPT brings OpenCV
/// and some hundred libraries more: 56 MB of memory in every process that loads it.
#include <limits>
#include <memory>
#include <stdexcept>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "simulated_rays.hpp"

namespace py = pybind11;

namespace glass_nav {
namespace {

using Occupancy = py::array_t<std::int8_t, py::array::c_style | py::array::forcecast>;

std::shared_ptr<SimulatedRays> make_rays(const Occupancy& occupancy, double resolution_m, int occupied_percent) {
  if (occupancy.ndim() != 2) throw std::invalid_argument("occupancy must be (H, W)");
  constexpr py::ssize_t kMost = std::numeric_limits<int>::max();
  if (occupancy.shape(0) > kMost || occupancy.shape(1) > kMost) throw std::invalid_argument("occupancy is too large");
  const auto height = static_cast<int>(occupancy.shape(0)), width = static_cast<int>(occupancy.shape(1));
  const std::int8_t* cells = occupancy.data();
  py::gil_scoped_release unlocked;
  return std::make_shared<SimulatedRays>(cells, height, width, resolution_m, occupied_percent);
}

}  // namespace
}  // namespace glass_nav

PYBIND11_MODULE(_mrpt_rays, module) {
  using namespace glass_nav;
  py::module::import("glass_nav._grid");  // has the base class
  py::class_<SimulatedRays, FreeRanges, std::shared_ptr<SimulatedRays>>(module, "SimulatedRays")
      .def(py::init(&make_rays), py::arg("occupancy"), py::arg("resolution_m"), py::arg("occupied_percent"));
}
