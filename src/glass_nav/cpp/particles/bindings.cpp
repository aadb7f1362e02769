/// The Python module _particles. Private: docstrings, checks and defaults are in
/// localization/particle_filter/pose_estimate.py.
#include <stdexcept>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "pose_clusters.hpp"

namespace py = pybind11;

namespace glass_nav {
namespace {

template <class T>
using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;

py::array_t<std::int32_t> clusters(const Array<double>& poses, const Array<double>& bin, int yaw_bins) {
  if (poses.ndim() != 2 || poses.shape(1) != 3) throw std::invalid_argument("poses must be (P, 3)");
  if (bin.size() != 3 || yaw_bins < 1) throw std::invalid_argument("a bin must be (3,), and yaw have at least one");
  py::array_t<std::int32_t> label(std::vector<py::ssize_t>{poses.shape(0)});
  std::int32_t* to = label.mutable_data();
  const double *from = poses.data(), *size = bin.data();
  py::gil_scoped_release unlocked;
  label_clusters(from, static_cast<std::size_t>(poses.shape(0)), {size[0], size[1], size[2], yaw_bins}, to);
  return label;
}

}  // namespace
}  // namespace glass_nav

PYBIND11_MODULE(_particles, module) {
  using namespace glass_nav;
  module.def("clusters", &clusters, py::arg("poses"), py::arg("bin"), py::arg("yaw_bins"));
}
