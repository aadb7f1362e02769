#include "scan_report.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace glass_nav {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr std::uint8_t kUncertain = 0, kDiffuse = 1;

/// Whether a beam and the next one meet the same straight wall first: no edge lies between them.
bool meets_wall_of_next(const StandingSurfaces& first, const CutRules& rules, std::size_t beam) {
  const double apart_m =
      std::abs(first.range_m[beam + 1] * first.cos[beam + 1] - first.range_m[beam] * first.cos[beam]);
  const double turned_rad = std::abs(first.axis_rad[beam + 1] - first.axis_rad[beam]);
  return apart_m < rules.same_wall_m && std::min(turned_rad, kPi - turned_rad) < rules.same_wall_rad;  // not if NaN
}

}  // namespace

Evidence evidence_of(const CaseBeams& scan, const double* first_m, const double* seen_through, const bool* known_end) {
  Evidence sums;
  for (std::size_t b = 0; b < scan.beams; ++b) {
    if (!std::isfinite(scan.measured_m[b])) continue;
    sums.answered += 1.0;
    if (scan.beam_case[b] != kUncertain) {
      sums.explained += 1.0;
      continue;
    }
    const bool crossed = scan.measured_m[b] > first_m[b];
    const double weight = known_end[b] ? 1.0 : crossed ? 1.0 - seen_through[b] : 0.0;
    (crossed ? sums.passed : sums.short_of) += weight;
  }
  return sums;
}

void cut_at_surfaces(const CaseBeams& scan, const StandingSurfaces& first, const CutRules& rules, double* range_m,
                     bool* cut) {
  const std::size_t beams = scan.beams;
  std::vector<char> same(beams + 1, 0), behind(beams + 2, 0);  // beam b: at b + 1, so that both ends have neighbours
  for (std::size_t b = 0; b + 1 < beams; ++b) same[b + 1] = meets_wall_of_next(first, rules, b);
  for (std::size_t b = 0; b < beams; ++b) {
    // Also without a return.
    behind[b + 1] = std::isfinite(first.range_m[b]) && scan.measured_m[b] > first.range_m[b] + first.gate_m[b];
  }
  for (std::size_t b = 0; b < beams; ++b) {
    const double measured_m = scan.measured_m[b], through = first.seen_through[b], there = first.there[b];
    const bool before = same[b], after = same[b + 1];
    const bool explained = scan.beam_case[b] > kDiffuse, known = through * there > rules.sure;
    const double silent = rules.no_return_glass * through;
    const bool gone_through = silent > rules.sure * (silent + rules.no_return_wall * (1.0 - through));
    // A wall instead would be bright enough to be seen: power falls with cosine and distance.
    const double share = first.range_m[b] / rules.max_range_m;
    const bool lost = std::isinf(measured_m) && measured_m > 0.0 && rules.dark_to_dim * first.cos[b] > share * share;
    const bool beside_lost = behind[b] || behind[b + 2];  // a single one may be a fault of the lidar
    const bool passed =
        there > rules.sure &&
        (std::isfinite(measured_m) ? before && after : (before || after) && gone_through && lost && beside_lost);
    cut[b] = behind[b + 1] && (explained || known || passed);
    range_m[b] = cut[b] ? first.range_m[b] : measured_m;
  }
}

}  // namespace glass_nav
