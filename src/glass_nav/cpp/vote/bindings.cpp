/// The Python module _beam_vote. Private: docstrings, checks and defaults are in
/// localization/beam_classification/case_votes.py.
#include <stdexcept>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "case_votes.hpp"

namespace py = pybind11;

namespace glass_nav {
namespace {

template <class T>
using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;

py::array_t<double> case_votes(const Array<double>& measured_m, const Array<double>& range_m, const Array<double>& cos,
                               const Array<float>& thickness_m, const Array<double>& prior, double nothing,
                               double depth_share, double sigma_m, double gate_m, double min_cos, double temper) {
  if (measured_m.ndim() != 1) throw std::invalid_argument("measured must be (B,)");
  const py::ssize_t beams = measured_m.shape(0), paths = kPaths, others = kOthers;
  const auto fits = [&](const py::array& array) {
    return array.ndim() == 3 && array.shape(0) == paths && array.shape(1) == range_m.shape(1) &&
           array.shape(2) == beams;
  };
  if (range_m.ndim() != 3 || range_m.shape(1) < 1 || !fits(range_m) || !fits(cos) || !fits(thickness_m)) {
    throw std::invalid_argument("ranges, cosines and thicknesses must be (4, N, B)");
  }
  if (prior.ndim() != 2 || prior.shape(0) != paths + others || prior.shape(1) != beams) {
    throw std::invalid_argument("priors must be (6, B)");
  }
  py::array_t<double> share({paths + 1, beams});
  const Offers offers{static_cast<std::size_t>(range_m.shape(1)),
                      static_cast<std::size_t>(beams),
                      measured_m.data(),
                      range_m.data(),
                      cos.data(),
                      thickness_m.data()};
  const Chances chances{prior.data(), nothing, depth_share, sigma_m, gate_m, min_cos, temper};
  double* to = share.mutable_data();
  py::gil_scoped_release unlocked;
  count_case_votes(offers, chances, to);
  return share;
}

}  // namespace
}  // namespace glass_nav

PYBIND11_MODULE(_beam_vote, module) {
  using namespace glass_nav;
  module.def("case_votes", &case_votes, py::arg("measured_m"), py::arg("range_m"), py::arg("cos"),
             py::arg("thickness_m"), py::arg("prior"), py::arg("nothing"), py::arg("depth_share"), py::arg("sigma_m"),
             py::arg("gate_m"), py::arg("min_cos"), py::arg("temper"));
}
