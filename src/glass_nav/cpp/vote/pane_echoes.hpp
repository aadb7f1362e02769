/// What comes back of a beam that a pane does not return itself? The formulation is in
/// localization/beam_classification/behind_panes.py.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "case_votes.hpp"

namespace glass_nav {

/// One beam at the pose itself.
struct PaneBeam {
  double measured_m;                   // not finite: no answer
  std::array<double, kPaths> range_m;  // where beams end
  std::array<double, kPaths> cos;      // of the incidence there; 1 where a surface has no normal
  double turned_rad;                   // from the axis of the pane to that of the mirrored wall's image; NaN: a corner
  double reflectance;                  // of clear glass at that incidence
  bool second_seen, third_seen;        // these walls are met from a side that a mapper saw
  bool unmapped_end;                   // a mapper did not see the place where the beam ended
  double back_cos;                     // of the incidence on a wall drawn from its other side, if it ended there; NaN
  bool back_drawn;                     // the map shows that wall on this beam, not only on a neighbour
};

struct PaneModel {
  double sigma_m;             // of beams around walls, across them
  double max_range_m;         // at which the lidar still sees a dark wall, face on
  double min_cos;             // lower bound of cosines
  const double* gains;        // coatings: times the reflectance of clear glass
  const double* frequencies;  // coatings: sum 1
  std::size_t coatings;
};

struct PaneEcho {
  double mirrored;  // probability that it is a mirrored echo
  double unmapped;  // density [1/m] at the measured range of ends behind the pane at what no map shows
};

/// Share of the light that a sheet of that refractive index mirrors: Fresnel, unpolarised, both surfaces; NaN: head on.
double reflectance_of(double incidence_rad, double index);

/// Sets the back_cos of beams that may have ended at the near face of a wall of which the map shows the other one. Past
/// the end of what is drawn of it, a beam may have met it if a neighbour did at about the same range.
void find_backs(std::vector<PaneBeam>& beams);

PaneEcho pane_echo(const PaneBeam& beam, const PaneModel& model);

}  // namespace glass_nav
