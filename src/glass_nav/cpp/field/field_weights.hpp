/// How well do poses explain where beams ended, by how far that is from the nearest wall? The formulation is in
/// localization/particle_filter/importance_weights.py.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "distance_field.hpp"
#include "scan_alignment.hpp"

namespace glass_nav {

/// Log density of a beam that ends at a distance from a wall: log(z_hit exp(-d^2 / (2 s^2)) + z_rand), tabulated.
class LogDensity {
 public:
  LogDensity(double sigma_m, double z_hit, double z_rand);

  static constexpr std::size_t kMost = 64;
  using Values = std::array<float, kMost>;

  /// Adds the log density at each of the distances [m], `count` of them, to its sum.
  __attribute__((always_inline)) void add_to(Values& sum, const Values& distance_m, std::size_t count) const {
    std::array<std::int32_t, kMost> number;
    std::array<Part, kMost> part;
    Values place, share;
    for (std::size_t k = 0; k < count; ++k) place[k] = std::min(distance_m[k] * per_m_, kParts);
    for (std::size_t k = 0; k < count; ++k) {
      number[k] = static_cast<std::int32_t>(place[k]);
      share[k] = place[k] - static_cast<float>(number[k]);
    }
    const Part* parts = parts_.data();
    for (std::size_t k = 0; k < count; ++k) std::memcpy(&part[k], parts + number[k], sizeof(Part));
    for (std::size_t k = 0; k < count; ++k) sum[k] += part[k].value + share[k] * part[k].growth;
  }

 private:
  static constexpr float kParts = 1024.0F;
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
