#include "field_weights.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace glass_nav {

LogDensity::LogDensity(double sigma_m, double z_hit, double z_rand) : per_m_(kParts / (kMaxSigmas * sigma_m)) {
  for (int part = 0; part <= kParts; ++part) {
    const double sigmas = kMaxSigmas * part / kParts;
    values_.push_back(std::log(z_hit * std::exp(-0.5 * sigmas * sigmas) + z_rand));
  }
}

double reach_of(const Points& points) {
  double squared = 0.0;
  for (std::size_t i = 0; i < points.count; ++i) {
    const double x = points.xy_m[2 * i], y = points.xy_m[2 * i + 1];
    squared = std::max(squared, x * x + y * y);
  }
  return std::sqrt(squared);
}

double log_weight_at(const DistanceField& field, const Points& points, double reach_m, const Pose& pose,
                     const LogDensity& density) {
  const DistanceField::Placed from_pose(field, pose);
  const bool is_inside = from_pose.is_inside(reach_m);
  double total = 0.0;
  for (std::size_t i = 0; i < points.count; ++i) {
    const double x = points.xy_m[2 * i], y = points.xy_m[2 * i + 1];
    total += density.at(is_inside ? from_pose.distance_inside(x, y) : from_pose.distance(x, y));
  }
  return total;
}

}  // namespace glass_nav
