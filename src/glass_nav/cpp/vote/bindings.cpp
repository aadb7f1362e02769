/// The Python module _beam_vote. Private: docstrings, checks and defaults are in
/// localization/beam_classification/: case_votes.py, behind_panes.py, glass_map.py, beam_evidence.py, surface_scan.py.
#include <algorithm>
#include <stdexcept>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "case_decision.hpp"
#include "case_votes.hpp"
#include "glass_odds.hpp"
#include "pane_echoes.hpp"
#include "scan_report.hpp"
#include "soft_vote.hpp"

namespace py = pybind11;

namespace glass_nav {
namespace {

template <class T>
using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;

Offers offers_of(const Array<double>& measured_m, const Array<double>& range_m, const Array<double>& cos,
                 const Array<float>& thickness_m) {
  if (measured_m.ndim() != 1) throw std::invalid_argument("measured must be (B,)");
  const py::ssize_t beams = measured_m.shape(0), paths = kPaths;
  const auto fits = [&](const py::array& array) {
    return array.ndim() == 3 && array.shape(0) == paths && array.shape(1) == range_m.shape(1) &&
           array.shape(2) == beams;
  };
  if (range_m.ndim() != 3 || range_m.shape(1) < 1 || !fits(range_m) || !fits(cos) || !fits(thickness_m)) {
    throw std::invalid_argument("ranges, cosines and thicknesses must be (4, N, B)");
  }
  return {static_cast<std::size_t>(range_m.shape(1)),
          static_cast<std::size_t>(beams),
          measured_m.data(),
          range_m.data(),
          cos.data(),
          thickness_m.data()};
}

void check_rows(const py::array& array, py::ssize_t rows, const Offers& offers, const char* text) {
  if (array.size() != rows * static_cast<py::ssize_t>(offers.beams)) throw std::invalid_argument(text);
}

py::array_t<double> shares_for(const Offers& offers) {
  return py::array_t<double>(std::vector<std::size_t>{kPaths + 1, offers.beams});
}

py::array_t<double> case_votes(const Array<double>& measured_m, const Array<double>& range_m, const Array<double>& cos,
                               const Array<float>& thickness_m, const Array<double>& prior, double nothing,
                               double depth_share, double sigma_m, double gate_m, double min_cos, double temper) {
  const Offers offers = offers_of(measured_m, range_m, cos, thickness_m);
  if (prior.ndim() != 2 || prior.shape(0) != static_cast<py::ssize_t>(kPaths + kOthers) ||
      prior.shape(1) != measured_m.shape(0)) {
    throw std::invalid_argument("priors must be (6, B)");
  }
  py::array_t<double> share = shares_for(offers);
  const Chances chances{prior.data(), nothing, depth_share, sigma_m, gate_m, min_cos, temper};
  double* to = share.mutable_data();
  py::gil_scoped_release unlocked;
  count_case_votes(offers, chances, to);
  return share;
}

PaneModel panes_of(const Array<double>& gains, const Array<double>& frequencies, double sigma_m, double max_range_m,
                   double min_cos) {
  if (gains.ndim() != 1 || gains.size() != frequencies.size()) throw std::invalid_argument("coatings must be (C,)");
  return {sigma_m, max_range_m, min_cos, gains.data(), frequencies.data(), static_cast<std::size_t>(gains.size())};
}

py::array_t<double> soft_votes(const Array<double>& measured_m, const Array<double>& range_m, const Array<double>& cos,
                               const Array<float>& thickness_m, const Array<double>& axis_rad,
                               const Array<bool>& seen_side, const Array<double>& reflectance,
                               const Array<double>& returns, const Array<bool>& unmapped_end,
                               const Array<double>& glass, const Array<double>& target_returns,
                               const Array<double>& gains, const Array<double>& frequencies, double porous_returns,
                               double uncertain, double uncertain_behind, double max_range_m, double depth_share,
                               double sigma_m, double gate_m, double min_cos, double temper, double pull) {
  const Offers offers = offers_of(measured_m, range_m, cos, thickness_m);
  check_rows(axis_rad, kPaths, offers, "axes must be (4, B)");
  check_rows(seen_side, kPaths, offers, "seen sides must be (4, B)");
  check_rows(reflectance, 1, offers, "reflectances must be (B,)");
  check_rows(returns, 1, offers, "returns must be (B,)");
  check_rows(unmapped_end, 1, offers, "unmapped ends must be (B,)");
  check_rows(glass, 4, offers, "chances of glass must be (2, 2, B)");
  check_rows(target_returns, 1, offers, "returns of mirrored surfaces must be (B,)");
  const PoseView view{axis_rad.data(),
                      seen_side.data(),
                      reflectance.data(),
                      returns.data(),
                      unmapped_end.data(),
                      glass.data(),
                      glass.data() + 2 * offers.beams,
                      target_returns.data()};
  const PaneModel panes = panes_of(gains, frequencies, sigma_m, max_range_m, min_cos);
  const SoftVote vote{{porous_returns, uncertain, uncertain_behind}, depth_share, gate_m, temper, pull};
  py::array_t<double> share = shares_for(offers);
  double* to = share.mutable_data();
  py::gil_scoped_release unlocked;
  vote_softly(offers, view, panes, vote, to);
  return share;
}

/// New arrays of the cases, copies of those given.
struct CaseArrays {
  py::array_t<std::uint8_t> beam_case;
  py::array_t<double> expected_m, residual_m, weight;

  explicit CaseArrays(const Offers& offers)
      : beam_case(shape(offers)), expected_m(shape(offers)), residual_m(shape(offers)), weight(shape(offers)) {}

  static std::vector<std::size_t> shape(const Offers& offers) { return {offers.beams}; }

  DecidedCases data() {
    return {beam_case.mutable_data(), expected_m.mutable_data(), residual_m.mutable_data(), weight.mutable_data()};
  }
  py::tuple tuple() const { return py::make_tuple(beam_case, expected_m, residual_m, weight); }
};

py::tuple decided(const Array<double>& share, const Array<double>& measured_m, const Array<double>& range_m,
                  const Array<double>& cos, const Array<float>& thickness_m, double min_share, double gate_m,
                  double depth_share, double min_cos) {
  const Offers offers = offers_of(measured_m, range_m, cos, thickness_m);
  check_rows(share, kPaths + 1, offers, "shares must be (5, B)");
  CaseArrays cases(offers);
  decide_cases(share.data(), offers, {min_share, gate_m, depth_share, min_cos}, cases.data());
  return cases.tuple();
}

py::tuple seen_from(const Array<std::uint8_t>& beam_case, const Array<double>& expected_m, const Array<double>& weight,
                    const Array<double>& measured_m, const Array<double>& range_m, const Array<double>& cos,
                    const Array<float>& thickness_m, double gate_m, double depth_share, double min_cos) {
  const Offers offers = offers_of(measured_m, range_m, cos, thickness_m);
  check_rows(beam_case, 1, offers, "cases must be (B,)");
  check_rows(expected_m, 1, offers, "expected ranges must be (B,)");
  check_rows(weight, 1, offers, "weights must be (B,)");
  CaseArrays cases(offers);
  std::copy_n(beam_case.data(), offers.beams, cases.beam_case.mutable_data());
  std::copy_n(expected_m.data(), offers.beams, cases.expected_m.mutable_data());
  std::copy_n(weight.data(), offers.beams, cases.weight.mutable_data());
  see_from(offers, {0.0, gate_m, depth_share, min_cos}, cases.data());
  return cases.tuple();
}

py::tuple pane_echoes(const Array<double>& measured_m, const Array<double>& range_m, const Array<double>& cos,
                      const Array<double>& turned_rad, const Array<double>& reflectance, const Array<bool>& seen_side,
                      const Array<bool>& unmapped_end, const Array<double>& gains, const Array<double>& frequencies,
                      double sigma_m, double max_range_m, double min_cos) {
  const std::vector<py::ssize_t> shape{measured_m.size()};
  const std::size_t beams = static_cast<std::size_t>(measured_m.size());
  const Offers beams_only{0, beams, nullptr, nullptr, nullptr, nullptr};
  check_rows(range_m, kPaths, beams_only, "ranges must be (4, B)");
  check_rows(cos, kPaths, beams_only, "cosines must be (4, B)");
  check_rows(seen_side, kPaths, beams_only, "seen sides must be (4, B)");
  for (const py::array& array : {py::array(turned_rad), py::array(reflectance), py::array(unmapped_end)}) {
    check_rows(array, 1, beams_only, "turns, reflectances and unmapped ends must be (B,)");
  }
  const PaneModel model = panes_of(gains, frequencies, sigma_m, max_range_m, min_cos);
  std::vector<PaneBeam> at_panes(beams);
  for (std::size_t b = 0; b < beams; ++b) {
    PaneBeam& beam = at_panes[b];
    for (std::size_t path = 0; path < kPaths; ++path) {
      beam.range_m[path] = range_m.data()[path * beams + b];
      beam.cos[path] = cos.data()[path * beams + b];
    }
    beam.measured_m = measured_m.data()[b];
    beam.turned_rad = turned_rad.data()[b];
    beam.reflectance = reflectance.data()[b];
    beam.second_seen = seen_side.data()[2 * beams + b];
    beam.third_seen = seen_side.data()[3 * beams + b];
    beam.unmapped_end = unmapped_end.data()[b];
  }
  find_backs(at_panes);
  py::array_t<double> mirrored(shape), unmapped(shape);
  for (std::size_t b = 0; b < beams; ++b) {
    const PaneEcho echo = pane_echo(at_panes[b], model);
    mirrored.mutable_data()[b] = echo.mirrored;
    unmapped.mutable_data()[b] = echo.unmapped;
  }
  return py::make_tuple(mirrored, unmapped);
}

std::vector<py::ssize_t> shape_of(const py::array& array) { return {array.shape(), array.shape() + array.ndim()}; }

py::array_t<double> reflectance(const Array<double>& incidence_rad, double index) {
  py::array_t<double> result(shape_of(incidence_rad));
  for (py::ssize_t i = 0; i < result.size(); ++i) {
    result.mutable_data()[i] = reflectance_of(incidence_rad.data()[i], index);
  }
  return result;
}

// -- what is learnt of walls

WallCells make_walls(const Array<std::int64_t>& wall, std::int64_t rows, std::int64_t columns) {
  const std::int64_t size = (rows + 2 * WallCells::kBorder) * (columns + 2 * WallCells::kBorder);
  const std::int64_t *first = wall.data(), *last = first + wall.size();
  if (rows < 1 || columns < 1 || !std::is_sorted(first, last) || (first != last && (*first < 0 || last[-1] >= size))) {
    throw std::invalid_argument("walls must be ascending cells of the map with its border");
  }
  return {rows, columns, CellSet(first, static_cast<std::size_t>(wall.size()), size)};
}

void check_memory(const py::array& log_odds) {
  if (log_odds.ndim() != 2 || log_odds.shape(0) != static_cast<py::ssize_t>(kQuestions)) {
    throw std::invalid_argument("log odds must be (2, W)");
  }
}

py::array_t<double> glass_chances(const WallCells& walls, const Array<float>& log_odds, double through, double there,
                                  const Array<std::int64_t>& cell) {
  check_memory(log_odds);
  std::vector<py::ssize_t> shape = shape_of(cell);
  shape.insert(shape.begin(), kQuestions);
  py::array_t<double> chances(shape);
  const std::array<double, kQuestions> priors{through, there};
  const py::ssize_t count = cell.size(), wall_count = log_odds.shape(1);
  const std::array<double, kQuestions> unknown{chance_of(through), chance_of(there)};
  for (py::ssize_t i = 0; i < count; ++i) {
    const std::int64_t wall = walls.number(cell.data()[i]);
    for (std::size_t k = 0; k < kQuestions; ++k) {
      const py::ssize_t row = static_cast<py::ssize_t>(k);
      chances.mutable_data()[row * count + i] =
          wall == CellSet::kNone ? unknown[k] : chance_of(priors[k] + log_odds.data()[row * wall_count + wall]);
    }
  }
  return chances;
}

py::array_t<bool> gone(const WallCells& walls, const Array<float>& log_odds, const Array<std::int64_t>& cell,
                       const Array<double>& axis_rad, const Array<bool>& opaque, double grid_yaw_rad, double prior,
                       double limit, double opaque_prior, double opaque_limit, double spread, int reach) {
  if (axis_rad.size() != cell.size() || opaque.size() != cell.size()) {
    throw std::invalid_argument("cells, axes and which are opaque must be (B,)");
  }
  const Openings openings{grid_yaw_rad, prior, limit, opaque_prior, opaque_limit, spread, reach};
  py::array_t<bool> found(shape_of(cell));
  for (py::ssize_t i = 0; i < cell.size(); ++i) {
    found.mutable_data()[i] =
        is_gone(walls, log_odds.data(), openings, cell.data()[i], axis_rad.data()[i], opaque.data()[i]);
  }
  return found;
}

void learn_glass(const WallCells& walls, py::array_t<float, py::array::c_style>& log_odds,
                 py::array_t<bool, py::array::c_style>& crossed, const Array<std::int64_t>& cell,
                 const Array<double>& evidence, const std::array<double, WallCells::kBorder + 1>& spread,
                 const std::array<double, kQuestions>& scan_share, double limit) {
  check_memory(log_odds);
  const auto count = static_cast<std::size_t>(cell.size()), wall_count = static_cast<std::size_t>(log_odds.shape(1));
  if (evidence.size() != 2 * cell.size()) throw std::invalid_argument("evidence must be (2, B)");
  learn_crossings(walls, {count, cell.data(), {evidence.data(), evidence.data() + count}}, {spread, scan_share, limit},
                  {{log_odds.mutable_data(), log_odds.mutable_data() + wall_count}, crossed.mutable_data()});
}

// -- what a scan says of the pose, and where it is cut

CaseBeams beams_of(const Array<double>& measured_m, const Array<std::uint8_t>& beam_case) {
  if (measured_m.ndim() != 1 || beam_case.size() != measured_m.size()) {
    throw std::invalid_argument("measured and cases must be (B,)");
  }
  return {static_cast<std::size_t>(measured_m.size()), measured_m.data(), beam_case.data()};
}

void check_beams(const py::array& array, const CaseBeams& scan) {
  if (array.size() != static_cast<py::ssize_t>(scan.beams)) throw std::invalid_argument("arrays must be (B,)");
}

py::tuple evidence(const Array<double>& measured_m, const Array<std::uint8_t>& beam_case, const Array<double>& first_m,
                   const Array<double>& seen_through, const Array<bool>& known_end) {
  const CaseBeams scan = beams_of(measured_m, beam_case);
  check_beams(first_m, scan);
  check_beams(seen_through, scan);
  check_beams(known_end, scan);
  const Evidence sums = evidence_of(scan, first_m.data(), seen_through.data(), known_end.data());
  return py::make_tuple(sums.answered, sums.explained, sums.short_of, sums.passed);
}

py::tuple cut(const Array<double>& measured_m, const Array<std::uint8_t>& beam_case, const Array<double>& range_m,
              const Array<double>& cos, const Array<double>& axis_rad, const Array<double>& glass,
              const Array<double>& gate_m, double max_range_m, double sure, double no_return_glass,
              double no_return_wall, double dark_to_dim, double same_wall_m, double same_wall_rad) {
  const CaseBeams scan = beams_of(measured_m, beam_case);
  for (const py::array& array : {py::array(range_m), py::array(cos), py::array(axis_rad), py::array(gate_m)}) {
    check_beams(array, scan);
  }
  if (glass.size() != 2 * measured_m.size()) throw std::invalid_argument("chances of glass must be (2, B)");
  py::array_t<double> ranges_m(measured_m.size());
  py::array_t<bool> is_cut(measured_m.size());
  cut_at_surfaces(scan,
                  {range_m.data(), cos.data(), axis_rad.data(), glass.data(), glass.data() + scan.beams, gate_m.data()},
                  {sure, no_return_glass, no_return_wall, dark_to_dim, max_range_m, same_wall_m, same_wall_rad},
                  ranges_m.mutable_data(), is_cut.mutable_data());
  return py::make_tuple(ranges_m, is_cut);
}

}  // namespace
}  // namespace glass_nav

PYBIND11_MODULE(_beam_vote, module) {
  using namespace glass_nav;
  module.def("case_votes", &case_votes, py::arg("measured_m"), py::arg("range_m"), py::arg("cos"),
             py::arg("thickness_m"), py::arg("prior"), py::arg("nothing"), py::arg("depth_share"), py::arg("sigma_m"),
             py::arg("gate_m"), py::arg("min_cos"), py::arg("temper"));
  module.def("soft_votes", &soft_votes, py::arg("measured_m"), py::arg("range_m"), py::arg("cos"),
             py::arg("thickness_m"), py::arg("axis_rad"), py::arg("seen_side"), py::arg("reflectance"),
             py::arg("returns"), py::arg("unmapped_end"), py::arg("glass"), py::arg("target_returns"), py::arg("gains"),
             py::arg("frequencies"), py::arg("porous_returns"), py::arg("uncertain"), py::arg("uncertain_behind"),
             py::arg("max_range_m"), py::arg("depth_share"), py::arg("sigma_m"), py::arg("gate_m"), py::arg("min_cos"),
             py::arg("temper"), py::arg("pull"));
  module.def("decided", &decided, py::arg("share"), py::arg("measured_m"), py::arg("range_m"), py::arg("cos"),
             py::arg("thickness_m"), py::arg("min_share"), py::arg("gate_m"), py::arg("depth_share"),
             py::arg("min_cos"));
  module.def("seen_from", &seen_from, py::arg("case"), py::arg("expected_m"), py::arg("weight"), py::arg("measured_m"),
             py::arg("range_m"), py::arg("cos"), py::arg("thickness_m"), py::arg("gate_m"), py::arg("depth_share"),
             py::arg("min_cos"));
  module.def("pane_echoes", &pane_echoes, py::arg("measured_m"), py::arg("range_m"), py::arg("cos"),
             py::arg("turned_rad"), py::arg("reflectance"), py::arg("seen_side"), py::arg("unmapped_end"),
             py::arg("gains"), py::arg("frequencies"), py::arg("sigma_m"), py::arg("max_range_m"), py::arg("min_cos"));
  module.def("reflectance", &reflectance, py::arg("incidence_rad"), py::arg("index"));
  py::class_<WallCells>(module, "WallCells")
      .def(py::init(&make_walls), py::arg("wall"), py::arg("rows"), py::arg("columns"))
      .def("chances", &glass_chances, py::arg("log_odds"), py::arg("through"), py::arg("there"), py::arg("cell"))
      .def("gone", &gone, py::arg("log_odds"), py::arg("cell"), py::arg("axis_rad"), py::arg("opaque"),
           py::arg("grid_yaw_rad"), py::arg("prior"), py::arg("limit"), py::arg("opaque_prior"),
           py::arg("opaque_limit"), py::arg("spread"), py::arg("reach"))
      .def("learn", &learn_glass, py::arg("log_odds").noconvert(), py::arg("crossed").noconvert(), py::arg("cell"),
           py::arg("evidence"), py::arg("spread"), py::arg("scan_share"), py::arg("limit"));
  module.def("evidence", &evidence, py::arg("measured_m"), py::arg("case"), py::arg("first_m"), py::arg("seen_through"),
             py::arg("known_end"));
  module.def("cut", &cut, py::arg("measured_m"), py::arg("case"), py::arg("range_m"), py::arg("cos"),
             py::arg("axis_rad"), py::arg("glass"), py::arg("gate_m"), py::arg("max_range_m"), py::arg("sure"),
             py::arg("no_return_glass"), py::arg("no_return_wall"), py::arg("dark_to_dim"), py::arg("same_wall_m"),
             py::arg("same_wall_rad"));
}
