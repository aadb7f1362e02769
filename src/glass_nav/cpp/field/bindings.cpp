/// The Python module _distance_field. Private: docstrings, checks and defaults are in sensing/distance_field.py and
/// hypotheses/scan_alignment.py.
#include <algorithm>
#include <cstddef>
#include <memory>
#include <stdexcept>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "distance_field.hpp"
#include "field_weights.hpp"
#include "scan_alignment.hpp"

namespace py = pybind11;

namespace glass_nav {
namespace {

template <class T>
using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;

std::unique_ptr<DistanceField> make_field(const Array<float>& distance_m, double resolution_m,
                                          const Array<double>& map_from_grid, double max_distance_m) {
  if (distance_m.ndim() != 2 || distance_m.size() == 0) throw std::invalid_argument("distances must be (H, W)");
  if (map_from_grid.ndim() != 1 || map_from_grid.shape(0) != 3) throw std::invalid_argument("origin must be (3,)");
  const double* origin = map_from_grid.data();
  return std::make_unique<DistanceField>(distance_m.data(), static_cast<int>(distance_m.shape(0)),
                                         static_cast<int>(distance_m.shape(1)), resolution_m,
                                         Pose{origin[0], origin[1], origin[2]}, max_distance_m);
}

std::vector<py::ssize_t> common_shape(const py::array& x_m, const py::array& y_m) {
  const std::vector<py::ssize_t> shape(x_m.shape(), x_m.shape() + x_m.ndim());
  if (x_m.ndim() != y_m.ndim() || !std::equal(shape.begin(), shape.end(), y_m.shape())) {
    throw std::invalid_argument("x and y must have one shape");
  }
  return shape;
}

/// Calls take(first, count, slopes) for one block of the points after the other.
template <class Take>
void for_each_block(const DistanceField& field, const double* x_m, const double* y_m, std::size_t points,
                    const Take& take) {
  using Slopes = DistanceField::Slopes;
  Slopes at;
  Slopes::Values x, y;
  for (std::size_t first = 0; first < points; first += Slopes::kMost) {
    const std::size_t count = std::min(Slopes::kMost, points - first);
    std::copy_n(x_m + first, count, x.begin());
    std::copy_n(y_m + first, count, y.begin());
    at.find(field, x, y, count);
    take(first, count, at);
  }
}

py::array_t<double> distance(const DistanceField& field, const Array<double>& x_m, const Array<double>& y_m) {
  py::array_t<double> result(common_shape(x_m, y_m));
  const double *x = x_m.data(), *y = y_m.data();
  double* to = result.mutable_data();
  const auto points = static_cast<std::size_t>(result.size());
  py::gil_scoped_release unlocked;
  for_each_block(field, x, y, points, [to](std::size_t first, std::size_t count, const DistanceField::Slopes& found) {
    std::copy_n(found.distance.begin(), count, to + first);
  });
  return result;
}

py::tuple at(const DistanceField& field, const Array<double>& x_m, const Array<double>& y_m) {
  const std::vector<py::ssize_t> shape = common_shape(x_m, y_m);
  py::array_t<double> distance_m(shape), along_x(shape), along_y(shape);
  double *to = distance_m.mutable_data(), *to_x = along_x.mutable_data(), *to_y = along_y.mutable_data();
  for_each_block(field, x_m.data(), y_m.data(), static_cast<std::size_t>(distance_m.size()),
                 [=](std::size_t first, std::size_t count, const DistanceField::Slopes& found) {
                   std::copy_n(found.distance.begin(), count, to + first);
                   std::copy_n(found.along_x.begin(), count, to_x + first);
                   std::copy_n(found.along_y.begin(), count, to_y + first);
                 });
  return py::make_tuple(distance_m, along_x, along_y);
}

Points points_of(const Array<double>& points_m) {
  if (points_m.ndim() != 2 || points_m.shape(1) != 2) throw std::invalid_argument("points must be (B, 2)");
  return {points_m.data(), static_cast<std::size_t>(points_m.shape(0))};
}

/// A copy, row by row.
std::vector<Pose> poses_of(const Array<double>& poses) {
  if (poses.ndim() != 2 || poses.shape(1) != 3) throw std::invalid_argument("poses must be (K, 3)");
  std::vector<Pose> copy(static_cast<std::size_t>(poses.shape(0)));
  for (std::size_t i = 0; i < copy.size(); ++i) std::copy_n(poses.data() + 3 * i, 3, copy[i].begin());
  return copy;
}

py::array_t<double> slid(const DistanceField& field, const Array<double>& points_m, const Array<double>& poses,
                         const Array<double>& held, double damping, int iterations, double first_scale_m,
                         double last_scale_m) {
  if (held.ndim() != 2 || held.shape(0) != 3 || held.shape(1) != 3) {
    throw std::invalid_argument("information must be (3, 3)");
  }
  const Points points = points_of(points_m);
  std::vector<Pose> moved = poses_of(poses);
  Steps steps{iterations, first_scale_m, last_scale_m, damping, {}};
  std::copy_n(held.data(), 9, steps.held.begin());
  py::array_t<double> result({static_cast<py::ssize_t>(moved.size()), py::ssize_t{3}});
  double* to = result.mutable_data();
  py::gil_scoped_release unlocked;
  for (Pose& pose : moved) {
    slide(field, points, steps, pose);
    to = std::copy(pose.begin(), pose.end(), to);
  }
  return result;
}

py::array_t<double> information(const DistanceField& field, const Array<double>& points_m, const Array<double>& poses,
                                double scale_m) {
  const Points points = points_of(points_m);
  const std::vector<Pose> at = poses_of(poses);
  py::array_t<double> result({static_cast<py::ssize_t>(at.size()), py::ssize_t{3}, py::ssize_t{3}});
  double* to = result.mutable_data();
  py::gil_scoped_release unlocked;
  for (const Pose& pose : at) {
    const Matrix3 sums = information_at(field, points, pose, scale_m);
    to = std::copy(sums.begin(), sums.end(), to);
  }
  return result;
}

py::array_t<double> fit(const DistanceField& field, const Array<double>& points_m, const Array<double>& poses,
                        double scale_m) {
  const Points points = points_of(points_m);
  const std::vector<Pose> at = poses_of(poses);
  py::array_t<double> result(static_cast<py::ssize_t>(at.size()));
  double* to = result.mutable_data();
  py::gil_scoped_release unlocked;
  for (const Pose& pose : at) *to++ = fit_at(field, points, pose, scale_m);
  return result;
}

py::array_t<double> log_weights(const DistanceField& field, const Array<double>& points_m, const Array<double>& poses,
                                double sigma_m, double z_hit, double z_rand) {
  const Points points = points_of(points_m);
  const std::vector<Pose> at = poses_of(poses);
  py::array_t<double> result(static_cast<py::ssize_t>(at.size()));
  double* to = result.mutable_data();
  py::gil_scoped_release unlocked;
  log_weights_at(field, points, at, LogDensity(sigma_m, z_hit, z_rand), to);
  return result;
}

}  // namespace
}  // namespace glass_nav

PYBIND11_MODULE(_distance_field, module) {
  using namespace glass_nav;
  py::class_<DistanceField>(module, "DistanceField")
      .def(py::init(&make_field), py::arg("distance_m"), py::arg("resolution_m"), py::arg("map_from_grid"),
           py::arg("max_distance_m"))
      .def("distance", &distance, py::arg("x_m"), py::arg("y_m"))
      .def("at", &at, py::arg("x_m"), py::arg("y_m"));
  module.def("slid", &slid, py::arg("field"), py::arg("points_m"), py::arg("poses"), py::arg("held"),
             py::arg("damping"), py::arg("iterations"), py::arg("first_scale_m"), py::arg("last_scale_m"));
  module.def("information", &information, py::arg("field"), py::arg("points_m"), py::arg("poses"), py::arg("scale_m"));
  module.def("fit", &fit, py::arg("field"), py::arg("points_m"), py::arg("poses"), py::arg("scale_m"));
  module.def("log_weights", &log_weights, py::arg("field"), py::arg("points_m"), py::arg("poses"), py::arg("sigma_m"),
             py::arg("z_hit"), py::arg("z_rand"));
}
