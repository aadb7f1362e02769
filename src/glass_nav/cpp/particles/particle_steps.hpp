/// The steps of a particle filter that look at every particle. The formulations are in localization/particle_filter:
/// resampling.py, proposal.py.
#pragma once

#include <cstddef>
#include <vector>

#include "../poses/matrix3.hpp"

namespace glass_nav {

/// Writes the numbers of the particles drawn with equal strides: the first at offset, 0..1, of a stride.
void draw_low_variance(const double* weights, std::size_t particles, double offset, std::size_t count,
                       std::ptrdiff_t* drawn);

/// A normal distribution over poses.
struct NormalPose {
  NormalPose(const Vector3& mean, const Matrix3& covariance);

  double log_density(const double* pose) const;

  Vector3 mean;
  Matrix3 root;     // of the covariance
  double log_norm;  // log density at the mean
};

/// Where particles are wanted, and where they were put.
struct Mixture {
  NormalPose by_odometry, by_slip;
  std::vector<NormalPose> by_scan;  // of equal weight
  double slip_probability;          // in the target
  double scan_share;                // in the proposal
};

/// Writes the log ratio of target to proposal density of each pose. The first `kept` poses were put there by odometry
/// itself: their ratio is at most 1 / (1 - scan_share).
void weigh_proposal(const double* poses, std::size_t count, std::size_t kept, const Mixture& mixture,
                    double* log_ratio);

}  // namespace glass_nav
