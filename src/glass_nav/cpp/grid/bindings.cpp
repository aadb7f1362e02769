/// The Python module _grid. Private: docstrings, checks and defaults are in sensing/raycast.py and
/// hypotheses/scan_matcher.py.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "expected_ranges.hpp"
#include "grid_raycaster.hpp"
#include "scan_matcher.hpp"

namespace py = pybind11;

namespace glass_nav {
namespace {

template <class T>
using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;

RayBatch batch_of(const Array<double>& poses, const Array<double>& angles, double max_range_m, int threads) {
  if (poses.ndim() != 2 || poses.shape(1) != 3) throw std::invalid_argument("poses must be (P, 3)");
  if (angles.ndim() != 1) throw std::invalid_argument("angles must be (B,)");
  if (!(max_range_m > 0.0)) throw std::invalid_argument("max_range must be > 0 m");
  if (threads < 1) throw std::invalid_argument("threads must be >= 1");
  return {poses.data(),  static_cast<std::size_t>(poses.shape(0)),
          angles.data(), static_cast<std::size_t>(angles.shape(0)),
          max_range_m,   threads};
}

template <class T>
py::array_t<T> result_for(const RayBatch& rays) {
  return py::array_t<T>({rays.pose_count, rays.angle_count});
}

/// Memory for several arrays, from the widest element to the narrowest. The allocator keeps one block for the next
/// scan; several it gives back to the system, and getting their pages again takes as long as the rays.
class ArrayBlock {
 public:
  explicit ArrayBlock(std::size_t bytes) : bytes_(static_cast<py::ssize_t>(bytes)) {}

  template <class T>
  py::array_t<T> next(const std::vector<py::ssize_t>& shape) {
    py::array_t<T> array(shape, reinterpret_cast<T*>(bytes_.mutable_data() + used_), bytes_);
    used_ += array.nbytes();
    return array;
  }

 private:
  py::array_t<std::uint8_t> bytes_;
  py::ssize_t used_ = 0;
};

std::unique_ptr<GridRaycaster> make_grid(const Array<std::int8_t>& occupancy, double resolution_m, int occupied_percent,
                                         bool unknown_stops, std::shared_ptr<FreeRanges> guide) {
  if (occupancy.ndim() != 2) throw std::invalid_argument("occupancy must be (H, W)");
  constexpr py::ssize_t kMost = std::numeric_limits<int>::max();
  if (occupancy.shape(0) > kMost || occupancy.shape(1) > kMost) throw std::invalid_argument("occupancy is too large");
  const auto height = static_cast<int>(occupancy.shape(0)), width = static_cast<int>(occupancy.shape(1));
  const std::int8_t* cells = occupancy.data();
  py::gil_scoped_release unlocked;
  return std::make_unique<GridRaycaster>(cells, height, width, resolution_m, occupied_percent, unknown_stops,
                                         std::move(guide));
}

void redraw(GridRaycaster& grid, const Array<std::int8_t>& occupancy, int first_row, int first_column, int rows,
            int columns) {
  if (occupancy.ndim() != 2 || occupancy.shape(0) != grid.height() || occupancy.shape(1) != grid.width()) {
    throw std::invalid_argument("occupancy must be (H, W) as before");
  }
  if (first_row < 0 || first_column < 0 || rows < 1 || columns < 1 || rows > grid.height() - first_row ||
      columns > grid.width() - first_column) {
    throw std::invalid_argument("the box must be in the grid");
  }
  const std::int8_t* cells = occupancy.data();
  py::gil_scoped_release unlocked;
  grid.redraw(cells, {first_column, first_row, first_column + columns, first_row + rows});
}

py::array_t<double> cast(const GridRaycaster& grid, const Array<double>& poses, const Array<double>& angles,
                         double max_range_m, int threads) {
  const RayBatch rays = batch_of(poses, angles, max_range_m, threads);
  auto range_m = result_for<double>(rays);
  double* to = range_m.mutable_data();
  py::gil_scoped_release unlocked;
  grid.cast_first(rays, to, nullptr);
  return range_m;
}

py::tuple cast_first(const GridRaycaster& grid, const Array<double>& poses, const Array<double>& angles,
                     double max_range_m, int threads) {
  const RayBatch rays = batch_of(poses, angles, max_range_m, threads);
  auto range_m = result_for<double>(rays);
  auto cell = result_for<std::int32_t>(rays);
  double* range_to = range_m.mutable_data();
  std::int32_t* cell_to = cell.mutable_data();
  {
    py::gil_scoped_release unlocked;
    grid.cast_first(rays, range_to, cell_to);
  }
  return py::make_tuple(range_m, cell);
}

py::dict cast_surfaces(const GridRaycaster& grid, const Array<double>& poses, const Array<double>& angles,
                       double max_range_m, double max_thickness_m, double min_linearity, double min_gap_m,
                       int threads) {
  const RayBatch rays = batch_of(poses, angles, max_range_m, threads);
  py::dict result;
  const auto real = [&](const char* name) {
    auto array = result_for<double>(rays);
    result[name] = array;
    return array.mutable_data();
  };
  const auto index = [&](const char* name) {
    auto array = result_for<std::int32_t>(rays);
    result[name] = array;
    return array.mutable_data();
  };
  const SurfaceArrays out{{real("first_m"), real("second_m"), real("third_m")},
                          {index("first_cell"), index("second_cell"), index("third_cell")},
                          {real("first_thickness_m"), real("second_thickness_m")},
                          real("normal_rad"),
                          real("linearity"),
                          real("mirrored_m"),
                          index("mirrored_cell")};
  {
    py::gil_scoped_release unlocked;
    grid.cast_surfaces(rays, {max_thickness_m, min_linearity, min_gap_m}, out);
  }
  return result;
}

py::tuple cast_paths(const GridRaycaster& grid, const Array<double>& poses, const Array<double>& angles,
                     const Array<double>& reach_m, double max_thickness_m, double min_linearity, double min_gap_m,
                     int threads) {
  constexpr double kUnused = 1.0;
  const RayBatch rays = batch_of(poses, angles, kUnused, threads);
  if (reach_m.ndim() != 1 || reach_m.shape(0) != angles.shape(0)) throw std::invalid_argument("reach must be (B,)");
  const std::vector<py::ssize_t> shape{4, poses.shape(0), angles.shape(0)};
  py::array_t<double> range_m(shape), cos(shape);
  py::array_t<std::int32_t> cell(shape);
  PathArrays out{};
  for (std::size_t path = 0; path < 4; ++path) {
    const std::size_t from = path * rays.pose_count * rays.angle_count;
    out.range_m[path] = range_m.mutable_data() + from;
    out.cos[path] = cos.mutable_data() + from;
    out.cell[path] = cell.mutable_data() + from;
  }
  {
    const double* reach = reach_m.data();
    py::gil_scoped_release unlocked;
    grid.cast_paths(rays, reach, nullptr, {max_thickness_m, min_linearity, min_gap_m}, out);
  }
  return py::make_tuple(range_m, cos, cell);
}

py::tuple expected_ranges(const GridRaycaster& grid, const Array<std::int8_t>& occupancy,
                          const Array<float>& thickness_m, const Array<double>& poses, const Array<double>& angles,
                          const Array<double>& measured_m, const Array<double>& reach_m, double gate_m,
                          double depth_share, double max_range_m, double max_thickness_m, double min_linearity,
                          double min_gap_m, bool mirrored_by_line, double grid_yaw, int threads) {
  const RayBatch rays = batch_of(poses, angles, max_range_m, threads);
  if (rays.pose_count < 1) throw std::invalid_argument("poses must be (P, 3), P > 0");
  if (reach_m.size() != angles.size() || measured_m.size() != angles.size()) {
    throw std::invalid_argument("measured and reach must be (B,)");
  }
  const py::ssize_t cells = static_cast<py::ssize_t>(grid.width()) * grid.height();
  if (occupancy.size() != cells || thickness_m.size() != cells) {
    throw std::invalid_argument("occupancy must be (H, W), and thicknesses (H * W,)");
  }
  const py::ssize_t paths = kPathCount, beams = angles.shape(0);
  const std::vector<py::ssize_t> of_samples{paths, poses.shape(0), beams}, of_pose{paths, beams}, of_beams{1, beams};
  ArrayBlock block(paths * poses.shape(0) * beams * (2 * sizeof(double) + sizeof(float) + sizeof(std::int32_t)));
  auto range_m = block.next<double>(of_samples), cos = block.next<double>(of_samples);
  auto thickness_to = block.next<float>(of_samples);
  auto cell = block.next<std::int32_t>(of_samples);
  py::array_t<double> incidence_rad(of_beams), line_m(of_pose), axis_rad(of_pose);
  py::array_t<bool> seen_side(of_pose);
  const Expectation wanted{rays,
                           measured_m.data(),
                           reach_m.data(),
                           gate_m,
                           depth_share,
                           occupancy.data(),
                           thickness_m.data(),
                           {max_thickness_m, min_linearity, min_gap_m},
                           mirrored_by_line,
                           grid_yaw};
  const ExpectedArrays out{range_m.mutable_data(),  cos.mutable_data(),           thickness_to.mutable_data(),
                           cell.mutable_data(),     incidence_rad.mutable_data(), line_m.mutable_data(),
                           axis_rad.mutable_data(), seen_side.mutable_data()};
  {
    py::gil_scoped_release unlocked;
    expect_ranges(grid, wanted, out);
  }
  return py::make_tuple(range_m, cos, thickness_to, cell, incidence_rad, line_m, axis_rad, seen_side);
}

py::array_t<double> free_ranges(const GridRaycaster& grid, const FreeRanges& rays, const Array<double>& poses,
                                const Array<double>& angles, double max_range_m) {
  const RayBatch batch = batch_of(poses, angles, max_range_m, 1);
  auto range_m = result_for<double>(batch);
  double* to = range_m.mutable_data();
  py::gil_scoped_release unlocked;
  grid.free_ranges(rays, batch, to);
  return range_m;
}

py::tuple walls_at(const GridRaycaster& grid, const Array<std::int32_t>& cell) {
  const std::int32_t* from = cell.data();
  const py::ssize_t count = cell.size();
  const std::int64_t cells = static_cast<std::int64_t>(grid.width()) * grid.height();
  if (std::any_of(from, from + count, [&](std::int32_t each) { return each < -1 || each >= cells; })) {
    throw std::invalid_argument("cells must be of the grid, or -1");
  }
  const std::vector<py::ssize_t> shape(cell.shape(), cell.shape() + cell.ndim());
  py::array_t<float> normal_rad(shape), linearity(shape), offset_m(shape);
  float *angle_to = normal_rad.mutable_data(), *linearity_to = linearity.mutable_data();
  float* offset_to = offset_m.mutable_data();
  {
    py::gil_scoped_release unlocked;
    constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
    constexpr WallNormals::Normal kNone{kNaN, kNaN, 0.0F, kNaN};
    const WallNormals& walls = grid.normals();
    for (py::ssize_t i = 0; i < count; ++i) {
      const WallNormals::Normal normal = from[i] < 0 ? kNone : walls.at(from[i]);
      angle_to[i] = std::atan2(normal.y, normal.x);
      linearity_to[i] = normal.linearity;
      offset_to[i] = static_cast<float>(normal.offset * grid.resolution_m());
    }
  }
  return py::make_tuple(normal_rad, linearity, offset_m);
}

std::shared_ptr<MatchGrid> make_match_grid(const Array<std::uint8_t>& scores, const Array<std::uint8_t>& allowed) {
  if (scores.ndim() != 2 || allowed.ndim() != 2 || scores.shape(0) != allowed.shape(0) ||
      scores.shape(1) != allowed.shape(1)) {
    throw std::invalid_argument("scores and allowed must be (H, W)");
  }
  const auto height = static_cast<int>(scores.shape(0)), width = static_cast<int>(scores.shape(1));
  const std::uint8_t *score = scores.data(), *may = allowed.data();
  py::gil_scoped_release unlocked;
  return std::make_shared<MatchGrid>(score, may, height, width);
}

std::unique_ptr<ScanSearch> make_search(std::shared_ptr<MatchGrid> grid, const Array<double>& points,
                                        const Array<double>& headings_rad, std::size_t keep, double max_behind) {
  if (points.ndim() != 2 || points.shape(1) != 2) throw std::invalid_argument("points must be (B, 2)");
  if (headings_rad.ndim() != 1) throw std::invalid_argument("headings must be (A,)");
  return std::make_unique<ScanSearch>(std::move(grid), points.data(), static_cast<std::size_t>(points.shape(0)),
                                      headings_rad.data(), static_cast<std::size_t>(headings_rad.shape(0)), keep,
                                      max_behind);
}

py::tuple places(const ScanSearch& search) {
  const std::vector<Match> found = search.places();
  const std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(found.size())};
  py::array_t<std::int32_t> row(shape), column(shape), turn(shape);
  py::array_t<float> score(shape);
  for (std::size_t i = 0; i < found.size(); ++i) {
    row.mutable_data()[i] = found[i].row;
    column.mutable_data()[i] = found[i].column;
    turn.mutable_data()[i] = found[i].heading;
    score.mutable_data()[i] = found[i].score;
  }
  return py::make_tuple(row, column, turn, score);
}

}  // namespace
}  // namespace glass_nav

PYBIND11_MODULE(_grid, module) {
  using namespace glass_nav;
  py::class_<FreeRanges, std::shared_ptr<FreeRanges>>(module, "FreeRanges");  // made by _mrpt_rays
  py::class_<GridRaycaster>(module, "Grid")
      .def(py::init(&make_grid), py::arg("occupancy"), py::arg("resolution_m"), py::arg("occupied_percent"),
           py::arg("unknown_stops"), py::arg("guide"))
      .def("cast", &cast, py::arg("poses"), py::arg("angles"), py::arg("max_range_m"), py::arg("threads"))
      .def("cast_first", &cast_first, py::arg("poses"), py::arg("angles"), py::arg("max_range_m"), py::arg("threads"))
      .def("cast_surfaces", &cast_surfaces, py::arg("poses"), py::arg("angles"), py::arg("max_range_m"),
           py::arg("max_thickness_m"), py::arg("min_linearity"), py::arg("min_gap_m"), py::arg("threads"))
      .def("cast_paths", &cast_paths, py::arg("poses"), py::arg("angles"), py::arg("reach_m"),
           py::arg("max_thickness_m"), py::arg("min_linearity"), py::arg("min_gap_m"), py::arg("threads"))
      .def("expected_ranges", &expected_ranges, py::arg("occupancy"), py::arg("thickness_m"), py::arg("poses"),
           py::arg("angles"), py::arg("measured_m"), py::arg("reach_m"), py::arg("gate_m"), py::arg("depth_share"),
           py::arg("max_range_m"), py::arg("max_thickness_m"), py::arg("min_linearity"), py::arg("min_gap_m"),
           py::arg("mirrored_by_line"), py::arg("grid_yaw"), py::arg("threads"))
      .def("free_ranges", &free_ranges, py::arg("rays"), py::arg("poses"), py::arg("angles"), py::arg("max_range_m"))
      .def("walls_at", &walls_at, py::arg("cell"))
      .def("redraw", &redraw, py::arg("occupancy"), py::arg("first_row"), py::arg("first_column"), py::arg("rows"),
           py::arg("columns"));
  py::class_<MatchGrid, std::shared_ptr<MatchGrid>>(module, "MatchGrid")
      .def(py::init(&make_match_grid), py::arg("scores"), py::arg("allowed"));
  py::class_<ScanSearch>(module, "ScanSearch")
      .def(py::init(&make_search), py::arg("grid"), py::arg("points"), py::arg("headings_rad"), py::arg("keep"),
           py::arg("max_behind"))
      .def("advance", &ScanSearch::advance, py::arg("look_ups"), py::call_guard<py::gil_scoped_release>())
      .def_property_readonly("look_ups", &ScanSearch::look_ups)
      .def("places", &places);
}
