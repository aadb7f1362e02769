#include "particle_steps.hpp"

#include <algorithm>
#include <cmath>

#include "../poses/poses.hpp"

namespace glass_nav {
namespace {

constexpr double kLogTwoPi = 1.8378770664093453;
constexpr double kSmallest = 1e-300;  // has a logarithm

double log_sum(double one, double other) {
  const double most = std::max(one, other);
  return std::isinf(most) ? most : most + std::log1p(std::exp(-std::abs(one - other)));
}

}  // namespace

void draw_low_variance(const double* weights, std::size_t particles, double offset, std::size_t count,
                       std::ptrdiff_t* drawn) {
  std::size_t number = 0;
  double sum = weights[0];
  for (std::size_t i = 0; i < count; ++i) {
    const double stride = (static_cast<double>(i) + offset) / static_cast<double>(count);
    while (sum <= stride && number + 1 < particles) sum += weights[++number];
    drawn[i] = static_cast<std::ptrdiff_t>(number);
  }
}

NormalPose::NormalPose(const Vector3& mean, const Matrix3& covariance) : mean(mean), root(cholesky(covariance)) {
  log_norm = -1.5 * kLogTwoPi - std::log(root(0, 0)) - std::log(root(1, 1)) - std::log(root(2, 2));
}

double NormalPose::log_density(const double* pose) const {
  const Vector3 z = solved(root, {pose[0] - mean[0], pose[1] - mean[1], wrap(pose[2] - mean[2])});
  return log_norm - 0.5 * dot(z, z);
}

void weigh_proposal(const double* poses, std::size_t count, std::size_t kept, const Mixture& mixture,
                    double* log_ratio) {
  const double slips = std::log(mixture.slip_probability + kSmallest), holds = std::log1p(-mixture.slip_probability);
  const double scans = std::log(mixture.scan_share), rest = std::log1p(-mixture.scan_share);
  const double each = scans - std::log(static_cast<double>(mixture.by_scan.size()));
  for (std::size_t i = 0; i < count; ++i, poses += 3) {
    const double odometry = mixture.by_odometry.log_density(poses);
    const double target = log_sum(holds + odometry, slips + mixture.by_slip.log_density(poses));
    double source = rest + odometry;
    for (const NormalPose& scan : mixture.by_scan) source = log_sum(source, each + scan.log_density(poses));
    log_ratio[i] = i < kept ? std::min(target - source, -rest) : target - source;
  }
}

}  // namespace glass_nav
