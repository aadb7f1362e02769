/// How well do poses explain where beams ended, by how far that is from the nearest wall? The formulation is in
/// localization/particle_filter/importance_weights.py.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "distance_field.hpp"
#include "scan_alignment.hpp"

namespace glass_nav {

/// Log density of a beam that ends at a distance from a wall: log(z_hit exp(-d^2 / (2 s^2)) + z_rand), tabulated.
class LogDensity {
 public:
  LogDensity(double sigma_m, double z_hit, double z_rand);

  float at(float distance_m) const {
    const float place = std::min(distance_m * per_m_, kParts);
    const int left = static_cast<int>(place);
    return parts_[left].value + (place - static_cast<float>(left)) * parts_[left].growth;
  }

 private:
  static constexpr float kParts = 2048.0F;
  static constexpr double kMaxSigmas = 10.0;  // beyond, the density is that at so many

  struct Part {
    float value, growth;  // at its beginning, and up to its end
  };

  float per_m_;
  std::vector<Part> parts_;
};

/// Writes for each pose the sum over the points of the log density, with the scan at that pose.
void log_weights_at(const DistanceField& field, const Points& points, const std::vector<Pose>& poses,
                    const LogDensity& density, double* log_w);

}  // namespace glass_nav
