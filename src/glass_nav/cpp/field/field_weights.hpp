/// How well do poses explain where beams ended, by how far that is from the nearest wall? The formulation is in
/// localization/particle_filter/importance_weights.py.
#pragma once

#include <vector>

#include "distance_field.hpp"
#include "scan_alignment.hpp"

namespace glass_nav {

/// Log density of a beam that ends at a distance from a wall: log(z_hit exp(-d^2 / (2 s^2)) + z_rand), tabulated.
class LogDensity {
 public:
  LogDensity(double sigma_m, double z_hit, double z_rand);

  double at(double distance_m) const {
    const double place = distance_m * per_m_;
    if (!(place < kParts)) return values_[kParts];  // also NaN
    const int left = static_cast<int>(place);
    return values_[left] + (place - left) * (values_[left + 1] - values_[left]);
  }

 private:
  static constexpr int kParts = 2048;
  static constexpr double kMaxSigmas = 10.0;  // beyond, the density is that at so many

  double per_m_;
  std::vector<double> values_;
};

/// How far the farthest point is from the robot [m].
double reach_of(const Points& points);

/// Sum over the points, none farther than reach_m, of the log density, with the scan at that pose.
double log_weight_at(const DistanceField& field, const Points& points, double reach_m, const Pose& pose,
                     const LogDensity& density);

}  // namespace glass_nav
