/// How may a beam end, before its range is looked at? The formulation is in
/// localization/beam_classification/case_votes.py.
#pragma once

#include "pane_echoes.hpp"

namespace glass_nav {

/// What is known of a beam's surfaces at the pose itself. Row-major arrays of kPaths * beams, or beams.
struct PoseView {
  const double* axis_rad;        // kPaths * beams: of the walls, of mirrored ones that of the image; NaN: none
  const bool* seen_side;         // kPaths * beams: met from a side that a mapper saw
  const double* reflectance;     // of clear glass at the incidence
  const double* returns;         // share of beams that a pane returns at that incidence
  const bool* unmapped_end;      // a mapper did not see where the beam ended
  const double* seen_through;    // 2 * beams: probability that the first, the second surface can be seen through
  const double* there;           // beams: probability that the first surface is there, if it can be seen through
  const double* target_returns;  // beams: share that comes back from the surface at the end of the mirrored path
};

struct PriorModel {
  double porous_returns;    // share of beams that things without a normal return
  double uncertain;         // prior of meeting what is not on the map
  double uncertain_behind;  // the same behind a pane
};

/// Ranges where beams end in walls, not at the near faces; of sample n.
std::array<double, kPaths> ends_in_walls(const Offers& offers, std::size_t sample, std::size_t beam, double depth_share,
                                         double min_cos);

/// Writes the priors of count_case_votes(), (kPaths + kOthers) * beams, from the first sample of the offers.
void case_priors(const Offers& offers, const PoseView& view, const PaneModel& panes, const PriorModel& model,
                 double depth_share, double* prior);

}  // namespace glass_nav
