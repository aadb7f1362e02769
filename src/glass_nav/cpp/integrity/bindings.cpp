/// The Python module _integrity. Private: docstrings and checks are in its faces of localization/integrity:
/// fit_information.py, pose_covariance.py, dead_reckoning.py.
#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "covariances.hpp"
#include "scan_fit.hpp"

namespace py = pybind11;

namespace glass_nav {
namespace {

using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;

template <std::size_t N>
std::array<double, N> values_of(const Array& array, const char* what) {
  if (array.size() != static_cast<py::ssize_t>(N)) {
    throw std::invalid_argument(std::string(what) + " must be of " + std::to_string(N) + " numbers");
  }
  std::array<double, N> values;
  std::copy_n(array.data(), N, values.begin());
  return values;
}

Vector3 vector_of(const Array& array) { return values_of<3>(array, "a pose"); }

Matrix3 matrix_of(const Array& array) { return {values_of<9>(array, "a covariance")}; }

py::array_t<double> array_of(const Vector3& vector) {
  return py::array_t<double>(std::vector<py::ssize_t>{3}, vector.data());
}

py::array_t<double> array_of(const Matrix3& matrix) {
  return py::array_t<double>(std::vector<py::ssize_t>{3, 3}, matrix.values.data());
}

py::tuple fit_of(ScanFit& fit, const DistanceField& field, const Array& points_m, const Array& laser_m,
                 const Array& map_from_base, double beam_share, double worth) {
  if (points_m.ndim() != 2 || points_m.shape(1) != 2 || points_m.shape(0) == 0) {
    throw std::invalid_argument("points must be (B, 2), B > 0");
  }
  const SeenScan scan{points_m.data(), static_cast<std::size_t>(points_m.shape(0)),
                      values_of<2>(laser_m, "the lidar's place"), vector_of(map_from_base)};
  FitInformation found;
  {
    py::gil_scoped_release unlocked;
    found = fit.of(field, scan, beam_share, worth);
  }
  return py::make_tuple(array_of(found.covariance), array_of(found.offset), found.share);
}

}  // namespace
}  // namespace glass_nav

PYBIND11_MODULE(_integrity, module) {
  using namespace glass_nav;
  py::class_<ScanFit>(module, "ScanFit")
      .def(py::init<double, bool>(), py::arg("resolution_m"), py::arg("square"))
      .def("of", &fit_of, py::arg("field"), py::arg("points_m"), py::arg("laser_m"), py::arg("map_from_base"),
           py::arg("beam_share"), py::arg("worth"));
  module.def(
      "better_of",
      [](const Array& first, const Array& second) { return array_of(better_of(matrix_of(first), matrix_of(second))); },
      py::arg("first"), py::arg("second"));
  module.def(
      "widened_by",
      [](const Array& covariance, const Array& spread) {
        return array_of(widened_by(matrix_of(covariance), matrix_of(spread)));
      },
      py::arg("covariance"), py::arg("spread"));
  module.def(
      "share_of_second",
      [](const Array& first, const Array& second) {
        return array_of(share_of_second(matrix_of(first), matrix_of(second)));
      },
      py::arg("first"), py::arg("second"));
  module.def(
      "carried",
      [](double yaw_rad, const Array& covariance, const Array& step, const Array& noise, const Array& noise_scale) {
        return array_of(
            carried(yaw_rad, matrix_of(covariance), vector_of(step), matrix_of(noise), vector_of(noise_scale)));
      },
      py::arg("yaw_rad"), py::arg("covariance"), py::arg("step"), py::arg("noise"), py::arg("noise_scale"));
  module.def(
      "mahalanobis",
      [](const Array& offset, const Array& covariance) {
        return mahalanobis(vector_of(offset), matrix_of(covariance));
      },
      py::arg("offset"), py::arg("covariance"));
}
