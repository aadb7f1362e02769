#include "pane_echoes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace glass_nav {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kPi = 3.14159265358979323846;
constexpr double kMostReflected = 0.9;
constexpr double kWallOverDark = 5.0;   // reflectance of a wall over that of the darkest one seen at the largest range
constexpr double kUnmappedPer_m = 0.2;  // things that end a beam where the map knows nothing
constexpr double kNewPer_m = 0.02;      // the same where it knows something: people, new furniture
constexpr double kFace_m = 0.5;         // a wall drawn from its other side has its near face at most so far before it
constexpr double kWallGoesOn = 0.5;     // probability that a wall which a pane adjoins goes on behind it, unmapped
constexpr double kGoesOnSigmas = 2.0;   // how straight it does
constexpr std::size_t kReach = 2;       // beams to either side that may meet the same face, where less of it is drawn
constexpr double kCornerCos = 0.5;      // of the incidence on a surface whose normal is not known
constexpr double kPerpendicular = 10.0 / 180.0 * kPi;

enum Path : std::size_t { kFirst, kMirrored, kSecond, kThird };

/// Probability that an echo of that amplitude over another is the stronger one; reflectances of other walls differ by
/// factors, so that against the same wall a victory is steeper.
double wins_over_other(double over) { return 1.0 / (1.0 + 1.0 / (over * over)); }
double wins_over_same(double over) { return 1.0 / (1.0 + 1.0 / (over * over * over * over)); }

double or_zero(double value) { return std::isnan(value) ? 0.0 : value; }

}  // namespace

double reflectance_of(double incidence_rad, double index) {
  const double angle = or_zero(incidence_rad), inside = std::sin(angle) / index;
  const double cos = std::cos(angle), cos_inside = std::sqrt(1.0 - inside * inside);
  const double across = (cos - index * cos_inside) / (cos + index * cos_inside);
  const double parallel = (cos_inside - index * cos) / (cos_inside + index * cos);
  const double surface = 0.5 * (across * across + parallel * parallel);
  return 2.0 * surface / (1.0 + surface);
}

void find_backs(std::vector<PaneBeam>& beams) {
  std::vector<bool> open(beams.size());  // the map has nothing behind the pane at about the measured range
  std::vector<double> own(beams.size(), kNaN);
  for (std::size_t b = 0; b < beams.size(); ++b) {
    open[b] = true;
    for (const Path path : {kSecond, kThird}) {
      const bool seen = path == kSecond ? beams[b].second_seen : beams[b].third_seen;
      const double before_m = beams[b].range_m[path] - beams[b].measured_m;
      if (std::abs(before_m) <= kFace_m) open[b] = false;
      if (!seen && before_m >= 0.0 && before_m <= kFace_m && std::isnan(own[b])) own[b] = beams[b].cos[path];
    }
  }
  for (std::size_t b = 0; b < beams.size(); ++b) {
    beams[b].back_cos = own[b];
    beams[b].back_drawn = !std::isnan(own[b]);
    if (!open[b]) continue;
    const std::size_t last = std::min(b + kReach, beams.size() - 1);
    for (std::size_t i = b < kReach ? 0 : b - kReach; i <= last && std::isnan(beams[b].back_cos); ++i) {
      if (std::abs(beams[i].measured_m - beams[b].measured_m) < kFace_m) beams[b].back_cos = own[i];
    }
  }
}

PaneEcho pane_echo(const PaneBeam& beam, const PaneModel& model) {
  const double first_m = beam.range_m[kFirst], mirrored_m = beam.range_m[kMirrored], behind_m = beam.range_m[kSecond];
  const bool corner = std::isnan(beam.turned_rad);
  const bool perpendicular = !(std::abs(std::cos(beam.turned_rad)) >= std::sin(kPerpendicular));  // also a corner
  const bool at_back = !std::isnan(beam.back_cos);
  const double goes_on = beam.unmapped_end && (perpendicular || at_back) ? kWallGoesOn : 0.0;
  const double stands = at_back ? 1.0 : goes_on;  // probability of a wall that the mirrored echo has to win over
  // A diffuse surface returns the more the less obliquely it is met.
  const double target_cos = corner ? kCornerCos : std::max(beam.cos[kMirrored], model.min_cos);
  const double than_wall = at_back ? std::sqrt(target_cos / std::max(beam.back_cos, model.min_cos)) : 1.0;
  const bool mirrors = std::isfinite(mirrored_m);
  double mirrored = 0.0, loses = 0.0;
  for (std::size_t i = 0; i < model.coatings; ++i) {
    const double reflected = std::min(model.gains[i] * beam.reflectance, kMostReflected);
    const double over = reflected / (1.0 - reflected), over_wall = wins_over_same(over * than_wall);
    loses += model.frequencies[i] * (1.0 - over_wall);
    if (!mirrors) continue;
    const double amplitude = reflected * model.max_range_m / mirrored_m;
    const double seen = 1.0 / (1.0 + 1.0 / (amplitude * amplitude * kWallOverDark));
    // Up to this range whatever stands behind the pane is brighter than the mirrored echo.
    const double reach_m = std::min(std::min(mirrored_m / over, behind_m), model.max_range_m);
    const double nothing_there = beam.unmapped_end ? std::exp(-kUnmappedPer_m * std::max(reach_m - first_m, 0.0)) : 1.0;
    mirrored +=
        model.frequencies[i] * seen *
        or_zero(stands * over_wall + (1.0 - stands) * nothing_there * wins_over_other(over * behind_m / mirrored_m));
  }
  const double past_m = beam.measured_m - first_m;
  if (!std::isfinite(beam.measured_m) || !(past_m > 0.0)) return {mirrored, 0.0};
  const double reached = beam.unmapped_end ? std::exp(-kUnmappedPer_m * past_m) : 1.0;
  const double density = beam.back_drawn ? 1.0 / kFace_m : beam.unmapped_end ? kUnmappedPer_m : kNewPer_m;
  double wall = 0.0;
  if (mirrors) {
    const double sigma_m = kGoesOnSigmas * model.sigma_m / std::max(beam.cos[kMirrored], model.min_cos);
    const double off = (beam.measured_m - mirrored_m) / sigma_m;
    wall = goes_on * loses * std::exp(-0.5 * off * off) / (std::sqrt(2.0 * kPi) * sigma_m);
  }
  return {mirrored, reached * density + wall};
}

}  // namespace glass_nav
