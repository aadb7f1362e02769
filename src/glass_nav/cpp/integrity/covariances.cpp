#include "covariances.hpp"

#include <algorithm>
#include <cmath>

namespace glass_nav {
namespace {

constexpr double kFar = 4.0;         // ratio of variances from which the spread of the particles counts
constexpr double kSmallest = 1e-12;  // variance that keeps a matrix definite

/// The covariance with a variance for each principal axis of another one, seen in units of the first.
template <class Ratio>
Matrix3 mixed(const Matrix3& first, const Matrix3& second, const Ratio& ratio) {
  const Matrix3 root = cholesky(first + Matrix3::diagonal(kSmallest));
  const Eigen3 of_second = eigen(whitened(root, second));
  const Matrix3 axes = root * of_second.axes;
  Matrix3 result;
  for (std::size_t k = 0; k < 3; ++k) {
    result.add_outer({axes(0, k), axes(1, k), axes(2, k)}, ratio(of_second.values[k]));
  }
  return result;
}

/// Of the second of two estimates, by the ratio of its variance to that of the first: close to a choice between them,
/// since errors that are correlated do not average out.
double share_by(double ratio) {
  const double squared = ratio * ratio;
  return 1.0 / (1.0 + squared * squared);
}

}  // namespace

Matrix3 share_of_second(const Matrix3& first, const Matrix3& second) {
  const Matrix3 root = cholesky(first + Matrix3::diagonal(kSmallest));
  const Eigen3 of_second = eigen(whitened(root, second));
  const Matrix3 axes = root * of_second.axes;
  Matrix3 along;  // of a difference, along the axes
  for (std::size_t j = 0; j < 3; ++j) {
    Vector3 unit{};
    unit[j] = 1.0;
    const Vector3 column = transposed(of_second.axes) * solved(root, unit);
    for (std::size_t k = 0; k < 3; ++k) along(k, j) = share_by(of_second.values[k]) * column[k];
  }
  return axes * along;
}

Matrix3 better_of(const Matrix3& first, const Matrix3& second) {
  return mixed(first, second, [](double value) {
    const double share = share_by(value), deviation = 1.0 - share + share * std::sqrt(value);
    return deviation * deviation;
  });
}

Matrix3 widened_by(const Matrix3& covariance, const Matrix3& spread) {
  return mixed(covariance, spread,
               [](double value) { return std::max(value * -std::expm1(-(value / kFar) * (value / kFar)), 1.0); });
}

Matrix3 carried(double yaw_rad, const Matrix3& covariance, const Vector3& step, const Matrix3& noise,
                const Vector3& noise_scale) {
  const double cos = std::cos(yaw_rad), sin = std::sin(yaw_rad);
  const Matrix3 turned{{cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0}};  // robot's axes before the step, in map
  const Vector3 along = turned * step;
  const Matrix3 by_pose{{1.0, 0.0, -along[1], 0.0, 1.0, along[0], 0.0, 0.0, 1.0}};
  Matrix3 scaled = noise;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) scaled(i, j) *= std::sqrt(noise_scale[i] * noise_scale[j]);
  return by_pose * covariance * transposed(by_pose) + turned * scaled * transposed(turned);
}

double mahalanobis(const Vector3& offset, const Matrix3& covariance) {
  const Vector3 whitened_offset = solved(cholesky(covariance), offset);
  return std::sqrt(dot(whitened_offset, whitened_offset));
}

}  // namespace glass_nav
