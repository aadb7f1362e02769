/// What a scan says of the pose, and where it is cut at glass. The formulations are in
/// localization/beam_classification/beam_evidence.py and surface_scan.py.
#pragma once

#include <cstddef>
#include <cstdint>

namespace glass_nav {

/// The beams of a scan, `beams` of each.
struct CaseBeams {
  std::size_t beams;
  const double* measured_m;
  const std::uint8_t* beam_case;
};

/// Numbers of beams, not whole.
struct Evidence {
  double answered = 0.0, explained = 0.0, short_of = 0.0, passed = 0.0;
};

/// @param first_m       to the first surface along each beam
/// @param seen_through  chance that it can be seen through
/// @param known_end     the map knows something of where the beam ended
Evidence evidence_of(const CaseBeams& scan, const double* first_m, const double* seen_through, const bool* known_end);

/// The first mapped surface along each beam that still stands.
struct StandingSurfaces {
  const double* range_m;
  const double* cos;
  const double* axis_rad;
  const double* seen_through;  // chances that it can be seen through, and if so that it is there
  const double* there;
  const double* gate_m;  // along the beam: what is measured so near to the surface is that surface
};

/// When a beam is cut.
struct CutRules {
  double sure;                             // chance from which a wall counts as glass, and as being there
  double no_return_glass, no_return_wall;  // shares of the beams that do not return
  double dark_to_dim, max_range_m;         // how far a wall of which reflectance is seen
  double same_wall_m, same_wall_rad;       // apart: neighbouring beams meet one wall
};

/// Writes the ranges of the cut scan, and which beams were cut.
void cut_at_surfaces(const CaseBeams& scan, const StandingSurfaces& first, const CutRules& rules, double* range_m,
                     bool* cut);

}  // namespace glass_nav
