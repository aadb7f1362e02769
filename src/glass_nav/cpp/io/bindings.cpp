// Module _mrpt_io: MRPT's files as numpy arrays. Its faces are recording/rawlog_file.py and world/map_file.py.

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "log_reader.hpp"

namespace py = pybind11;

namespace {

template <typename T>
py::array_t<T> array(const std::vector<T>& values) {
  return py::array_t<T>(static_cast<py::ssize_t>(values.size()), values.data());
}

template <std::size_t N>
py::array_t<double> table(const std::vector<std::array<double, N>>& rows) {
  py::array_t<double> out({static_cast<py::ssize_t>(rows.size()), static_cast<py::ssize_t>(N)});
  auto* to = out.mutable_data();
  for (const auto& row : rows) to = std::copy(row.begin(), row.end(), to);
  return out;
}

py::dict read_rawlog(const std::string& path) {
  glass_nav::Rawlog log;
  {
    py::gil_scoped_release released;
    log = glass_nav::read_rawlog(path);
  }
  py::dict out;
  out["stamps_ns"] = array(log.stamps_ns);
  out["beams"] = array(log.beams);
  out["ranges_m"] = array(log.ranges_m);
  out["valid"] = array(log.valid);
  out["first_angle_rad"] = array(log.first_angle_rad);
  out["angle_step_rad"] = array(log.angle_step_rad);
  out["range_max_m"] = array(log.range_max_m);
  out["sensor_pose"] = table(log.sensor_pose);
  out["labels"] = log.labels;
  out["odometry_index"] = array(log.odometry_index);
  out["odometry_stamps_ns"] = array(log.odometry_stamps_ns);
  out["odometry"] = table(log.odometry);
  out["objects"] = log.objects;
  out["paired"] = log.paired;
  out["broken"] = log.broken;
  return out;
}

py::dict read_grid_map(const std::string& path) {
  glass_nav::GridFile grid;
  {
    py::gil_scoped_release released;
    grid = glass_nav::read_grid_map(path);
  }
  py::dict out;
  const std::array<py::ssize_t, 2> shape{grid.rows, grid.columns};  // by the constructor: pybind11 2.4 has no reshape
  out["occupancy"] = py::array_t<std::int8_t>(shape, grid.occupancy.data());
  out["resolution_m"] = grid.resolution_m;
  out["x_min_m"] = grid.x_min_m;
  out["y_min_m"] = grid.y_min_m;
  return out;
}

}  // namespace

PYBIND11_MODULE(_mrpt_io, module) {
  module.def("read_rawlog", &read_rawlog, py::arg("path"));
  module.def("read_grid_map", &read_grid_map, py::arg("path"));
}
