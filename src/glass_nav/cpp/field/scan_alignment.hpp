/// Poses -> poses nearby where a scan fits the walls best. The formulation is in hypotheses/scan_alignment.py.
#pragma once

#include <array>
#include <cstddef>

#include "distance_field.hpp"
#include "known_area.hpp"

namespace glass_nav {

using Pose = std::array<double, 3>;     // x [m], y [m], yaw [rad]
using Matrix3 = std::array<double, 9>;  // row-major

/// End points of beams in the robot's frame: x and y in turn.
struct Points {
  const double* xy_m;
  std::size_t count;
};

/// Gauss-Newton steps: how many, the scale of the kernel in the first and the last [m], and what keeps them short. All
/// information is in units of one beam's.
struct Steps {
  int iterations;
  double first_scale_m, last_scale_m;
  double damping;  // information that holds each step where it begins
  Matrix3 held;    // information that holds the pose where it starts
};

/// Moves the pose to where the scan fits.
void slide(const DistanceField& field, const Points& points, const Steps& steps, Pose& pose);

/// Sum of J J^T over the beams, weighed by a kernel of that scale.
Matrix3 information_at(const DistanceField& field, const Points& points, const Pose& pose, double scale_m);

/// Mean over the beams of s^2 / (s^2 + d^2).
double fit_at(const DistanceField& field, const Points& points, const Pose& pose, double scale_m);

/// The same, but points that end where the map knows nothing count unknown_fit, or 0 where the pose itself is unmapped.
double known_fit_at(const DistanceField& field, const KnownArea& area, const Points& points, const Pose& pose,
                    double scale_m, double unknown_fit);

}  // namespace glass_nav
