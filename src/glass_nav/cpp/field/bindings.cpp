/// The Python module _distance_field. Private: docstrings, checks and defaults are in sensing/distance_field.py,
/// sensing/known_area.py, sensing/wall_backs.py, hypotheses/scan_alignment.py and hypotheses/global_search.py.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "distance_field.hpp"
#include "field_weights.hpp"
#include "known_area.hpp"
#include "scan_alignment.hpp"
#include "wall_backs.hpp"

namespace py = pybind11;

namespace glass_nav {
namespace {

template <class T>
using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;

Pose pose_of(const Array<double>& pose) {
  if (pose.ndim() != 1 || pose.shape(0) != 3) throw std::invalid_argument("a pose must be (3,)");
  return {pose.data()[0], pose.data()[1], pose.data()[2]};
}

std::unique_ptr<DistanceField> make_field(const Array<float>& distance_m, double resolution_m,
                                          const Array<double>& map_from_grid, double max_distance_m) {
  if (distance_m.ndim() != 2 || distance_m.size() == 0) throw std::invalid_argument("distances must be (H, W)");
  return std::make_unique<DistanceField>(distance_m.data(), static_cast<int>(distance_m.shape(0)),
                                         static_cast<int>(distance_m.shape(1)), resolution_m, pose_of(map_from_grid),
                                         max_distance_m);
}

std::unique_ptr<KnownArea> make_area(const Array<std::uint8_t>& flags, int border, double resolution_m,
                                     const Array<double>& map_from_grid) {
  if (flags.ndim() != 2 || flags.size() == 0) throw std::invalid_argument("flags must be (H, W)");
  return std::make_unique<KnownArea>(flags.data(), static_cast<int>(flags.shape(0)), static_cast<int>(flags.shape(1)),
                                     border, resolution_m, pose_of(map_from_grid));
}

/// Of points (..., 2).
py::array_t<bool> has(const KnownArea& area, std::uint8_t flag, const Array<double>& points_m) {
  if (points_m.ndim() < 1 || points_m.shape(points_m.ndim() - 1) != 2) {
    throw std::invalid_argument("points must be (..., 2)");
  }
  py::array_t<bool> result(std::vector<py::ssize_t>(points_m.shape(), points_m.shape() + points_m.ndim() - 1));
  const double* point = points_m.data();
  bool* to = result.mutable_data();
  for (py::ssize_t i = 0; i < result.size(); ++i, point += 2) {
    to[i] = area.has(static_cast<CellFlag>(flag), point[0], point[1]);
  }
  return result;
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

py::array_t<double> known_fit(const DistanceField& field, const KnownArea& area, const Array<double>& points_m,
                              const Array<double>& poses, double scale_m, double unknown_fit) {
  const Points points = points_of(points_m);
  const std::vector<Pose> at = poses_of(poses);
  py::array_t<double> result(static_cast<py::ssize_t>(at.size()));
  double* to = result.mutable_data();
  py::gil_scoped_release unlocked;
  for (const Pose& pose : at) *to++ = known_fit_at(field, area, points, pose, scale_m, unknown_fit);
  return result;
}

/// (B,) of beams by where they ended and their directions, both in the robot's frame.
py::array_t<bool> end_at_backs(const DistanceField& field, const KnownArea& area, const Array<double>& points_m,
                               const Array<double>& bearings_rad, const Array<double>& map_from_base, double before_m,
                               double thickest_m, double side_m) {
  const Points points = points_of(points_m);
  const Pose pose = pose_of(map_from_base);
  if (bearings_rad.ndim() != 1 || static_cast<std::size_t>(bearings_rad.size()) != points.count) {
    throw std::invalid_argument("bearings must be (B,)");
  }
  py::array_t<bool> result(bearings_rad.size());
  const double cos = std::cos(pose[2]), sin = std::sin(pose[2]);
  for (std::size_t b = 0; b < points.count; ++b) {
    const double x_m = points.xy_m[2 * b], y_m = points.xy_m[2 * b + 1], bearing = bearings_rad.data()[b] + pose[2];
    result.mutable_data()[b] = ends_at_back(field, area, {before_m, thickest_m, side_m},
                                            {pose[0] + cos * x_m - sin * y_m, pose[1] + sin * x_m + cos * y_m},
                                            {std::cos(bearing), std::sin(bearing)});
  }
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
  py::class_<KnownArea>(module, "KnownArea")
      .def(py::init(&make_area), py::arg("flags"), py::arg("border"), py::arg("resolution_m"), py::arg("map_from_grid"))
      .def("has", &has, py::arg("flag"), py::arg("points_m"));
  module.def("slid", &slid, py::arg("field"), py::arg("points_m"), py::arg("poses"), py::arg("held"),
             py::arg("damping"), py::arg("iterations"), py::arg("first_scale_m"), py::arg("last_scale_m"));
  module.def("information", &information, py::arg("field"), py::arg("points_m"), py::arg("poses"), py::arg("scale_m"));
  module.def("fit", &fit, py::arg("field"), py::arg("points_m"), py::arg("poses"), py::arg("scale_m"));
  module.def("known_fit", &known_fit, py::arg("field"), py::arg("area"), py::arg("points_m"), py::arg("poses"),
             py::arg("scale_m"), py::arg("unknown_fit"));
  module.def("end_at_backs", &end_at_backs, py::arg("field"), py::arg("area"), py::arg("points_m"),
             py::arg("bearings_rad"), py::arg("map_from_base"), py::arg("before_m"), py::arg("thickest_m"),
             py::arg("side_m"));
  module.def("log_weights", &log_weights, py::arg("field"), py::arg("points_m"), py::arg("poses"), py::arg("sigma_m"),
             py::arg("z_hit"), py::arg("z_rand"));
}
