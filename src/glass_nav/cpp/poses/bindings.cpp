/// The Python module _poses. Private: docstrings are in geometry/se2.py.
#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "poses.hpp"

namespace py = pybind11;

namespace glass_nav {
namespace {

using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Shape = std::vector<py::ssize_t>;

/// Rows (..., N) of an array of C order.
struct Rows {
  Rows(const Array& array, py::ssize_t numbers) : data(array.data()), numbers(numbers) {
    if (array.ndim() < 1 || array.shape(array.ndim() - 1) != numbers) {
      throw std::invalid_argument("the last axis must have " + std::to_string(numbers) + " numbers");
    }
    shape.assign(array.shape(), array.shape() + array.ndim() - 1);
    count = array.size() / numbers;
  }

  const double* data;
  py::ssize_t numbers, count;
  Shape shape;  // of the leading axes
};

Shape broadcast(const Shape& one, const Shape& other) {
  Shape result(std::max(one.size(), other.size()), 1);
  for (const Shape* shape : {&one, &other}) {
    for (std::size_t back = 1; back <= shape->size(); ++back) {
      py::ssize_t &length = result[result.size() - back], given = (*shape)[shape->size() - back];
      if (length != given && length != 1 && given != 1) throw std::invalid_argument("the shapes do not broadcast");
      if (length == 1) length = given;
    }
  }
  return result;
}

/// Where each row of the broadcast shape is among the rows of a shape.
Shape places(const Shape& shape, const Shape& broadcast_shape, py::ssize_t count) {
  Shape steps(broadcast_shape.size(), 0);
  py::ssize_t step = 1;
  for (std::size_t back = 1; back <= shape.size(); ++back) {
    const py::ssize_t length = shape[shape.size() - back];
    steps[steps.size() - back] = length == 1 ? 0 : step;
    step *= length;
  }
  Shape result(static_cast<std::size_t>(count)), index(steps.size(), 0);
  py::ssize_t place = 0;
  for (py::ssize_t& to : result) {
    to = place;
    for (std::size_t axis = steps.size(); axis-- > 0;) {
      place += steps[axis];
      if (++index[axis] < broadcast_shape[axis]) break;
      place -= steps[axis] * index[axis];
      index[axis] = 0;
    }
  }
  return result;
}

/// Calls work with each pair of rows, and where the result goes.
template <class Work>
py::array_t<double> by_rows(const Rows& one, const Rows& other, const Work& work) {
  const Shape common = one.shape == other.shape ? one.shape : broadcast(one.shape, other.shape);
  Shape shape = common;
  shape.push_back(other.numbers);
  py::array_t<double> result(shape);
  const py::ssize_t count = result.size() / other.numbers;
  double* to = result.mutable_data();
  py::gil_scoped_release unlocked;
  const auto is_simple = [count](const Rows& rows) { return rows.count == count || rows.count == 1; };
  if (is_simple(one) && is_simple(other)) {
    const py::ssize_t step = one.count == 1 ? 0 : one.numbers, other_step = other.count == 1 ? 0 : other.numbers;
    for (py::ssize_t i = 0; i < count; ++i, to += other.numbers)
      work(one.data + i * step, other.data + i * other_step, to);
    return result;
  }
  const Shape place = places(one.shape, common, count), other_place = places(other.shape, common, count);
  for (std::size_t i = 0; i < place.size(); ++i, to += other.numbers)
    work(one.data + place[i] * one.numbers, other.data + other_place[i] * other.numbers, to);
  return result;
}

py::array_t<double> composed(const Array& a_from_b, const Array& b_from_c) {
  Motion motion;
  return by_rows(Rows(a_from_b, 3), Rows(b_from_c, 3),
                 [&](const double* by, const double* pose_b, double* pose_a) { motion.pose(by, pose_b, pose_a); });
}

py::array_t<double> transformed(const Array& a_from_b, const Array& points_b) {
  Motion motion;
  return by_rows(Rows(a_from_b, 3), Rows(points_b, 2),
                 [&](const double* by, const double* point_b, double* point_a) { motion.point(by, point_b, point_a); });
}

py::array_t<double> inverse(const Array& a_from_b) {
  const Rows poses(a_from_b, 3);
  py::array_t<double> result(Shape(a_from_b.shape(), a_from_b.shape() + a_from_b.ndim()));
  double* to = result.mutable_data();
  py::gil_scoped_release unlocked;
  for (py::ssize_t i = 0; i < poses.count; ++i) invert(poses.data + 3 * i, to + 3 * i);
  return result;
}

}  // namespace
}  // namespace glass_nav

PYBIND11_MODULE(_poses, module) {
  using namespace glass_nav;
  module.def("compose", &composed, py::arg("a_from_b"), py::arg("b_from_c"));
  module.def("inverse", &inverse, py::arg("a_from_b"));
  module.def("transform_points", &transformed, py::arg("a_from_b"), py::arg("points_b"));
}
