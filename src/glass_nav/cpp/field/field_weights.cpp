#include "field_weights.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "vectorized.hpp"

namespace glass_nav {

LogDensity::LogDensity(double sigma_m, double z_hit, double z_rand)
    : per_m_(static_cast<float>(kParts / (kMaxSigmas * sigma_m))) {
  const auto value_at = [&](int part) {
    const double sigmas = kMaxSigmas * part / kParts;
    return std::log(z_hit * std::exp(-0.5 * sigmas * sigmas) + z_rand);
  };
  const int parts = static_cast<int>(kParts);
  for (int part = 0; part < parts; ++part) {
    const double value = value_at(part);
    parts_.push_back({static_cast<float>(value), static_cast<float>(value_at(part + 1) - value)});
  }
  parts_.push_back({static_cast<float>(value_at(parts)), 0.0F});
}

GLASS_NAV_VECTORIZED void log_weights_at(const DistanceField& field, const Points& points,
                                         const std::vector<Pose>& poses, const LogDensity& density, double* log_w) {
  using Frames = DistanceField::Frames;
  static_assert(Frames::kMost == LogDensity::kMost);
  LogDensity::Values distance_m, sum;
  for (std::size_t first = 0; first < poses.size(); first += Frames::kMost) {
    const std::size_t count = std::min(Frames::kMost, poses.size() - first);
    const Frames from_poses(field, poses.data() + first, count);
    sum.fill(0.0F);
    for (std::size_t i = 0; i < points.count; ++i) {
      from_poses.distances(points.xy_m[2 * i], points.xy_m[2 * i + 1], distance_m.data());
      density.add_to(sum, distance_m, count);
    }
    std::copy_n(sum.begin(), count, log_w + first);
  }
}

}  // namespace glass_nav
