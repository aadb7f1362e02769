/// Which beams ended at the back of a wall? The formulation is in sensing/wall_backs.py.
#pragma once

#include <array>

#include "distance_field.hpp"
#include "known_area.hpp"

namespace glass_nav {

/// Lengths in metres.
struct WallBacks {
  double before_m;    // the end of a beam: there the field shows the side from which the beam came
  double thickest_m;  // from there to the face that is drawn
  double side_m;      // from that face, to both sides: what the mapper saw
};

/// Whether a beam ended at a back. All in the frame map: where it ended, and its unit vector.
inline bool ends_at_back(const DistanceField& field, const KnownArea& area, const WallBacks& backs,
                         const std::array<double, 2>& end_m, const std::array<double, 2>& ahead) {
  const double x = end_m[0] - backs.before_m * ahead[0], y = end_m[1] - backs.before_m * ahead[1];
  const Slope at = field.at(x, y);  // its derivatives lead away from the wall
  if (!(at.distance < backs.thickest_m && at.along_x * ahead[0] + at.along_y * ahead[1] < 0.0)) return false;
  const double near_m = at.distance - backs.side_m, far_m = at.distance + backs.side_m;
  return area.has(kUnmapped, x - near_m * at.along_x, y - near_m * at.along_y) &&
         area.has(kFree, x - far_m * at.along_x, y - far_m * at.along_y);
}

}  // namespace glass_nav
