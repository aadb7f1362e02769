#include "field_weights.hpp"

#include <cmath>
#include <cstddef>

namespace glass_nav {

LogDensity::LogDensity(double sigma_m, double z_hit, double z_rand) : per_m_(kParts / (kMaxSigmas * sigma_m)) {
  for (int part = 0; part <= kParts; ++part) {
    const double sigmas = kMaxSigmas * part / kParts;
    values_.push_back(std::log(z_hit * std::exp(-0.5 * sigmas * sigmas) + z_rand));
  }
}

double log_weight_at(const DistanceField& field, const Points& points, const Pose& pose, const LogDensity& density) {
  const DistanceField::Placed from_pose(field, pose);
  double total = 0.0;
  for (std::size_t i = 0; i < points.count; ++i) {
    total += density.at(from_pose.distance(points.xy_m[2 * i], points.xy_m[2 * i + 1]));
  }
  return total;
}

}  // namespace glass_nav
