#include "case_decision.hpp"

#include <array>
#include <cmath>
#include <limits>

#include "case_priors.hpp"

namespace glass_nav {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr std::array<std::size_t, kPaths + 1> kTieOrder{1, 3, 4, 2, 0};  // of equal shares the first wins
constexpr double kOtherSurface_m = 0.3;  // between two expected ranges: an edge lies between them
constexpr double kReportedGates = 2.0;   // the samples that won the vote may be one gate away from the reported pose

struct Expected {
  double range_m = kNaN, across_m = kInfinite;  // from the surface to the end of the beam
};

Expected expected_of(std::size_t beam_case, const Offers& offers, std::size_t sample, std::size_t beam,
                     const DecisionModel& model) {
  const std::size_t path = beam_case > 0 ? beam_case - 1 : 0;
  const double end_m = ends_in_walls(offers, sample, beam, model.depth_share, model.min_cos)[path];
  const double cos = offers.cos[(path * offers.samples + sample) * offers.beams + beam];
  const double across_m = std::abs(offers.measured_m[beam] - end_m) * cos;
  return {end_m, std::isnan(across_m) ? kInfinite : across_m};
}

void put(std::size_t beam, std::size_t beam_case, double measured_m, double expected_m, const DecidedCases& out) {
  out.beam_case[beam] = static_cast<std::uint8_t>(beam_case);
  out.expected_m[beam] = beam_case > 0 ? expected_m : kNaN;
  out.residual_m[beam] = beam_case > 0 ? measured_m - expected_m : kNaN;
}

}  // namespace

void decide_cases(const double* share, const Offers& offers, const DecisionModel& model, const DecidedCases& out) {
  for (std::size_t b = 0; b < offers.beams; ++b) {
    std::size_t won = kTieOrder[0];
    for (const std::size_t other : kTieOrder) {
      if (share[other * offers.beams + b] > share[won * offers.beams + b]) won = other;
    }
    const double measured_m = offers.measured_m[b];
    if (!std::isfinite(measured_m) || !(share[won * offers.beams + b] >= model.min_share)) won = 0;
    out.weight[b] = share[won * offers.beams + b];
    Expected best;
    if (won > 0) best = expected_of(won, offers, 0, b, model);
    if (won > 0 && !(best.across_m <= model.gate_m)) {
      for (std::size_t n = 0; n < offers.samples; ++n) {
        const Expected there = expected_of(won, offers, n, b, model);
        if (n == 0 || there.across_m < best.across_m) best = there;
      }
    }
    put(b, std::isfinite(best.across_m) ? won : 0, measured_m, best.range_m, out);
  }
}

void see_from(const Offers& offers, const DecisionModel& model, const DecidedCases& out) {
  for (std::size_t b = 0; b < offers.beams; ++b) {
    const std::size_t beam_case = out.beam_case[b];
    const Expected here = expected_of(beam_case, offers, 0, b, model);
    const double before_m = out.expected_m[b];
    const bool other = std::abs(here.range_m - before_m) > kOtherSurface_m;  // also where there is none
    const bool fits = here.across_m <= kReportedGates * model.gate_m;
    put(b, fits || other ? beam_case : 0, offers.measured_m[b], fits ? here.range_m : before_m, out);
  }
}

}  // namespace glass_nav
