/// Which particles are one hypothesis? The formulation is in localization/particle_filter/pose_estimate.py.
#pragma once

#include <cstddef>
#include <cstdint>

namespace glass_nav {

/// Bins of a histogram over poses: x, y and yaw [m, m, rad]. Yaw goes round in so many bins.
struct PoseBins {
  double x_m, y_m, yaw_rad;
  int yaw_bins;
};

/// Writes the cluster of each pose: filled bins that touch, also at a corner, are one cluster.
/// @param poses  count * 3, row by row: x [m], y [m], yaw [rad], all finite
/// @param label  count; clusters are numbered by their first bins in x, then y, then yaw
void label_clusters(const double* poses, std::size_t count, const PoseBins& bins, std::int32_t* label);

}  // namespace glass_nav
