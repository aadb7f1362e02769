/// The Python module _particles. Private: docstrings, checks and defaults are in its faces of
/// localization/particle_filter: pose_estimate.py, resampling.py, proposal.py.
#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "particle_steps.hpp"
#include "pose_bins.hpp"
#include "pose_clusters.hpp"

namespace py = pybind11;

namespace glass_nav {
namespace {

using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// (P, 3).
struct Poses {
  explicit Poses(const Array& array) : data(array.data()), count(static_cast<std::size_t>(array.size() / 3)) {
    if (array.ndim() != 2 || array.shape(1) != 3) throw std::invalid_argument("poses must be (P, 3)");
  }

  const double* data;
  std::size_t count;
};

BinSize bin_size_of(const Array& bin) {
  if (bin.size() != 3) throw std::invalid_argument("a bin must be (3,)");
  return {bin.data()[0], bin.data()[1], bin.data()[2]};
}

const double* weights_of(const Array& weights, const Poses& poses) {
  if (weights.ndim() != 1 || static_cast<std::size_t>(weights.size()) != poses.count) {
    throw std::invalid_argument("weights must be (P,)");
  }
  return weights.data();
}

py::array_t<double> array_of(const Vector3& vector) {
  return py::array_t<double>(std::vector<py::ssize_t>{3}, vector.data());
}

py::array_t<double> array_of(const Matrix3& matrix) {
  return py::array_t<double>(std::vector<py::ssize_t>{3, 3}, matrix.values.data());
}

py::tuple moments(const Array& poses, const Array& weights) {
  const Poses from(poses);
  const Moments found = moments_of(from.data, weights_of(weights, from), from.count, nullptr);
  return py::make_tuple(array_of(found.mean), array_of(found.covariance));
}

py::tuple best_cluster(const Array& poses, const Array& weights, const Array& bin, int yaw_bins) {
  const Poses from(poses);
  if (from.count == 0 || yaw_bins < 1) throw std::invalid_argument("there must be a pose, and a bin of yaw");
  const double* weight = weights_of(weights, from);
  const BinSize size = bin_size_of(bin);
  py::array_t<bool> members(std::vector<py::ssize_t>{poses.shape(0)});
  bool* to = members.mutable_data();
  double share = 0.0;
  Moments found;
  {
    py::gil_scoped_release unlocked;
    share = mark_best_cluster(from.data, weight, from.count, size, yaw_bins, to);
    found = moments_of(from.data, weight, from.count, to);
  }
  return py::make_tuple(array_of(found.mean), array_of(found.covariance), share, members);
}

std::size_t count_bins(const Array& poses, const Array& bin) {
  const Poses from(poses);
  const BinSize size = bin_size_of(bin);
  py::gil_scoped_release unlocked;
  return filled_bins(from.data, from.count, size, 0).bins.size();
}

py::array_t<std::ptrdiff_t> low_variance(const Array& weights, std::size_t count, double offset) {
  if (weights.ndim() != 1 || weights.size() == 0) throw std::invalid_argument("weights must be (P,), P > 0");
  py::array_t<std::ptrdiff_t> drawn(static_cast<py::ssize_t>(count));
  std::ptrdiff_t* to = drawn.mutable_data();
  const double* from = weights.data();
  const auto particles = static_cast<std::size_t>(weights.size());
  py::gil_scoped_release unlocked;
  draw_low_variance(from, particles, offset, count, to);
  return drawn;
}

NormalPose normal_pose(const double* mean, const double* covariance) {
  Matrix3 matrix;
  std::copy_n(covariance, 9, matrix.values.begin());
  return {{mean[0], mean[1], mean[2]}, matrix};
}

py::array_t<double> proposal_log_ratio(const Array& poses, std::size_t kept, const Array& mean, const Array& near,
                                       const Array& slipped, const Array& aligned, const Array& around,
                                       double slip_probability, double scan_share) {
  const Poses from(poses), scans(aligned);
  if (mean.size() != 3 || near.size() != 9 || slipped.size() != 9) {
    throw std::invalid_argument("a normal distribution must be of a mean (3,) and a covariance (3, 3)");
  }
  if (scans.count == 0 || static_cast<std::size_t>(around.size()) != 9 * scans.count) {
    throw std::invalid_argument("aligned poses must be (K, 3), K > 0, and their covariances (K, 3, 3)");
  }
  Mixture mixture{normal_pose(mean.data(), near.data()),
                  normal_pose(mean.data(), slipped.data()),
                  {},
                  slip_probability,
                  scan_share};
  for (std::size_t i = 0; i < scans.count; ++i)
    mixture.by_scan.push_back(normal_pose(scans.data + 3 * i, around.data() + 9 * i));
  py::array_t<double> log_ratio(static_cast<py::ssize_t>(from.count));
  double* to = log_ratio.mutable_data();
  py::gil_scoped_release unlocked;
  weigh_proposal(from.data, from.count, kept, mixture, to);
  return log_ratio;
}

}  // namespace
}  // namespace glass_nav

PYBIND11_MODULE(_particles, module) {
  using namespace glass_nav;
  module.def("moments", &moments, py::arg("poses"), py::arg("weights"));
  module.def("best_cluster", &best_cluster, py::arg("poses"), py::arg("weights"), py::arg("bin"), py::arg("yaw_bins"));
  module.def("count_bins", &count_bins, py::arg("poses"), py::arg("bin"));
  module.def("low_variance", &low_variance, py::arg("weights"), py::arg("count"), py::arg("offset"));
  module.def("proposal_log_ratio", &proposal_log_ratio, py::arg("poses"), py::arg("kept"), py::arg("mean"),
             py::arg("near"), py::arg("slipped"), py::arg("aligned"), py::arg("around"), py::arg("slip_probability"),
             py::arg("scan_share"));
}
