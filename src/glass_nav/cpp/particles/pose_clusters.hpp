/// Particles -> the cluster with the most weight. The formulation is in localization/particle_filter/pose_estimate.py.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "../poses/matrix3.hpp"
#include "pose_bins.hpp"

namespace glass_nav {

struct Moments {
  Vector3 mean;
  Matrix3 covariance;  // over x [m], y [m], yaw [rad]
};

/// Of weighted poses, yaw on the circle. members: those that count; null: all.
Moments moments_of(const double* poses, const double* weights, std::size_t count, const bool* members);

/// Marks the members of the cluster with the most weight, and returns the weight. Bins that touch are one cluster;
/// those of yaw go round.
double mark_best_cluster(const double* poses, const double* weights, std::size_t count, const BinSize& size,
                         std::int64_t yaw_bins, bool* members);

}  // namespace glass_nav
