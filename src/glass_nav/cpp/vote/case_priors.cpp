#include "case_priors.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace glass_nav {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kMinSeenThrough = 0.05;  // a cell may hold a post and the edge of the pane beside it
constexpr double kUnseenSide = 0.002;  // probability that a beam meets a wall from an unmapped side, over a mapped one

enum Path : std::size_t { kFirst, kMirrored, kSecond, kThird };

}  // namespace

std::array<double, kPaths> ends_in_walls(const Offers& offers, std::size_t sample, std::size_t beam, double depth_share,
                                         double min_cos) {
  const std::size_t plane = offers.samples * offers.beams, first = sample * offers.beams + beam;
  std::array<double, kPaths> ends;
  for (std::size_t path = 0; path < kPaths; ++path) {
    const std::size_t at = path * plane + first;
    ends[path] = offers.range_m[at] + depth_share * offers.thickness_m[at] / std::max(offers.cos[at], min_cos);
  }
  // A mirror lies that much deeper.
  ends[kMirrored] += 2.0 * depth_share * offers.thickness_m[first] * offers.cos[first];
  return ends;
}

namespace {

std::vector<PaneBeam> beams_at_panes(const Offers& offers, const PoseView& view, const PaneModel& panes,
                                     double depth_share) {
  const std::size_t beams = offers.beams, plane = offers.samples * beams;
  std::vector<PaneBeam> result(beams);
  for (std::size_t b = 0; b < beams; ++b) {
    PaneBeam& beam = result[b];
    beam.measured_m = offers.measured_m[b];
    beam.range_m = ends_in_walls(offers, 0, b, depth_share, panes.min_cos);
    for (std::size_t path = 0; path < kPaths; ++path) beam.cos[path] = offers.cos[path * plane + b];
    beam.turned_rad = view.axis_rad[kMirrored * beams + b] - view.axis_rad[kFirst * beams + b];
    beam.reflectance = view.reflectance[b];
    beam.second_seen = view.seen_side[kSecond * beams + b];
    beam.third_seen = view.seen_side[kThird * beams + b];
    beam.unmapped_end = view.unmapped_end[b];
  }
  find_backs(result);
  return result;
}

}  // namespace

void case_priors(const Offers& offers, const PoseView& view, const PaneModel& panes, const PriorModel& model,
                 double depth_share, double* prior) {
  const std::size_t beams = offers.beams;
  const std::vector<PaneBeam> pane_beams = beams_at_panes(offers, view, panes, depth_share);
  for (std::size_t b = 0; b < beams; ++b) {
    const PaneEcho echo = pane_echo(pane_beams[b], panes);
    const double through = std::min(std::max(view.seen_through[b], kMinSeenThrough), 1.0);
    const double passes = through * view.there[b] * (1.0 - view.returns[b]), gone = through * (1.0 - view.there[b]);
    const double mirrored = passes * echo.mirrored * view.target_returns[b];
    const double behind = (passes - mirrored) * (1.0 - model.uncertain_behind);
    const double again = view.seen_through[beams + b] * (1.0 - model.porous_returns);
    const double peak_m = std::sqrt(2.0 * kPi) * panes.sigma_m / std::max(pane_beams[b].cos[kMirrored], panes.min_cos);
    const std::array<double, kPaths + kOthers> of_beam{1.0 - passes - gone, mirrored, behind * (1.0 - again),
                                                       behind * again,      gone,     passes * echo.unmapped * peak_m};
    for (std::size_t row = 0; row < of_beam.size(); ++row) {
      const bool unseen = row > kFirst && row < kPaths && !view.seen_side[row * beams + b];
      prior[row * beams + b] = (1.0 - model.uncertain) * of_beam[row] * (unseen ? kUnseenSide : 1.0);
    }
  }
}

}  // namespace glass_nav
