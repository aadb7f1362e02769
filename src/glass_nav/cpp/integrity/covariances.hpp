/// Covariances of a pose over x, y and yaw in map. The formulations are in localization/integrity/pose_covariance.py
/// and dead_reckoning.py.
#pragma once

#include "../poses/matrix3.hpp"

namespace glass_nav {

/// Share of the second of two estimates, as a matrix: in each direction nearly all of it where its covariance is the
/// smaller one, nearly nothing where it is the larger one.
Matrix3 share_of_second(const Matrix3& first, const Matrix3& second);

/// Covariance of the first estimate with that share of the second, however their errors are correlated.
Matrix3 better_of(const Matrix3& first, const Matrix3& second);

/// A covariance, in directions in which a spread is far larger that spread.
Matrix3 widened_by(const Matrix3& covariance, const Matrix3& spread);

/// Covariance of a pose with that yaw after a step, in the robot's frame before it, which adds noise in that frame; its
/// variances are scaled.
Matrix3 carried(double yaw_rad, const Matrix3& covariance, const Vector3& step, const Matrix3& noise,
                const Vector3& noise_scale);

/// Length of an offset in standard deviations.
double mahalanobis(const Vector3& offset, const Matrix3& covariance);

}  // namespace glass_nav
