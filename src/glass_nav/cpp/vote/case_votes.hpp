/// The soft vote on what each beam met, summed over the samples. The formulation is in
/// localization/beam_classification/case_votes.py.
#pragma once

#include <cstddef>
#include <cstdint>

namespace glass_nav {

constexpr std::size_t kPaths = 4;   // to the first surface, mirrored there, to the second and the third
constexpr std::size_t kOthers = 2;  // ends on no map: at the second surface where the first is gone; anywhere else

/// Expected and measured ranges. Row-major arrays of kPaths * samples * beams, or beams.
struct Offers {
  std::size_t samples, beams;
  const double* measured_m;  // beams; not finite: no answer
  const double* range_m;     // where the near boundary of the wall is met; inf: nowhere
  const double* cos;         // of the incidence there
  const float* thickness_m;  // of the wall there
};

/// How a beam may end.
struct Chances {
  const double* prior;  // (kPaths + kOthers) * beams: of the cases in the order of the paths, then of other ends
  double nothing;       // prior of meeting something that is on no map
  double depth_share;   // of the thickness of a wall: how deep in it beams end
  double sigma_m;       // around that, across the wall
  double gate_m;        // a beam that ends farther from a reference, across the wall, does not belong to it
  double min_cos;       // lower bound of cos: a surface seen at a smaller angle counts as one at this
  double temper;        // of a sample's evidence
};

/// Writes shares of the vote, (kPaths + 1) * beams: nothing on the map, then the cases in the order of the paths; the
/// shares of each beam add up to 1. The prior of an end anywhere else is a density on the scale of the others, which
/// are 1 at the peak: it does not depend on the sample.
void count_case_votes(const Offers& offers, const Chances& chances, double* share);

}  // namespace glass_nav
