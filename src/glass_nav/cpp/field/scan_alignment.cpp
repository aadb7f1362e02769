#include "scan_alignment.hpp"

#include <algorithm>
#include <cmath>

#include "vectorized.hpp"

namespace glass_nav {
namespace {

using Slopes = DistanceField::Slopes;

constexpr double kPi = 3.14159265358979323846;

double wrap(double angle_rad) { return angle_rad - 2.0 * kPi * std::floor((angle_rad + kPi) / (2.0 * kPi)); }

/// Upper triangle of a symmetric 3 x 3 matrix, and a right side.
struct Equations {
  double a00 = 0.0, a01 = 0.0, a02 = 0.0, a11 = 0.0, a12 = 0.0, a22 = 0.0;
  double b0 = 0.0, b1 = 0.0, b2 = 0.0;
};

/// Of the squared distances, with Geman-McClure weights.
GLASS_NAV_VECTORIZED Equations normal_equations(const DistanceField& field, const Points& points, const Pose& pose,
                                                double scale_m) {
  const double cos = std::cos(pose[2]), sin = std::sin(pose[2]), square = scale_m * scale_m;
  Slopes at;
  Slopes::Values x, y, map_x, map_y, along_yaw, weight;
  Equations sums;
  for (std::size_t first = 0; first < points.count; first += Slopes::kMost) {
    const std::size_t count = std::min(Slopes::kMost, points.count - first);
    const double* from = points.xy_m + 2 * first;
    for (std::size_t i = 0; i < count; ++i) {
      x[i] = cos * from[2 * i] - sin * from[2 * i + 1];
      y[i] = sin * from[2 * i] + cos * from[2 * i + 1];
      map_x[i] = pose[0] + x[i];
      map_y[i] = pose[1] + y[i];
    }
    at.find(field, map_x, map_y, count);
    for (std::size_t i = 0; i < count; ++i) {
      const double root = square / (square + at.distance[i] * at.distance[i]);
      weight[i] = root * root;
      along_yaw[i] = at.along_y[i] * x[i] - at.along_x[i] * y[i];
    }
    for (std::size_t i = 0; i < count; ++i) {
      const double w0 = weight[i] * at.along_x[i], w1 = weight[i] * at.along_y[i], w2 = weight[i] * along_yaw[i];
      sums.a00 += w0 * at.along_x[i];
      sums.a01 += w0 * at.along_y[i];
      sums.a02 += w0 * along_yaw[i];
      sums.a11 += w1 * at.along_y[i];
      sums.a12 += w1 * along_yaw[i];
      sums.a22 += w2 * along_yaw[i];
      sums.b0 += w0 * at.distance[i];
      sums.b1 += w1 * at.distance[i];
      sums.b2 += w2 * at.distance[i];
    }
  }
  return sums;
}

/// By Cramer's rule; the matrix is positive definite.
Pose solve(const Equations& e) {
  const double c00 = e.a11 * e.a22 - e.a12 * e.a12, c01 = e.a02 * e.a12 - e.a01 * e.a22,
               c02 = e.a01 * e.a12 - e.a02 * e.a11, c11 = e.a00 * e.a22 - e.a02 * e.a02,
               c12 = e.a01 * e.a02 - e.a00 * e.a12, c22 = e.a00 * e.a11 - e.a01 * e.a01;
  const double scale = 1.0 / (e.a00 * c00 + e.a01 * c01 + e.a02 * c02);
  return {scale * (c00 * e.b0 + c01 * e.b1 + c02 * e.b2), scale * (c01 * e.b0 + c11 * e.b1 + c12 * e.b2),
          scale * (c02 * e.b0 + c12 * e.b1 + c22 * e.b2)};
}

/// The points of a scan at one pose, a block after the other, and the field there.
struct Ends {
  Ends(const Points& points, const Pose& pose)
      : points_(points), pose_(pose), cos_(std::cos(pose[2])), sin_(std::sin(pose[2])) {}

  /// Goes on to the next block; false after the last one.
  __attribute__((always_inline)) bool next(const DistanceField& field) {
    first_ += count;
    count = std::min(Slopes::kMost, points_.count - first_);
    const double* from = points_.xy_m + 2 * first_;
    for (std::size_t i = 0; i < count; ++i) {
      x_m[i] = pose_[0] + cos_ * from[2 * i] - sin_ * from[2 * i + 1];
      y_m[i] = pose_[1] + sin_ * from[2 * i] + cos_ * from[2 * i + 1];
    }
    at.find(field, x_m, y_m, count);
    return count > 0;
  }

  Slopes at;
  Slopes::Values x_m, y_m;
  std::size_t count = 0;  // in the present block

 private:
  const Points& points_;
  const Pose& pose_;
  double cos_, sin_;
  std::size_t first_ = 0;
};

}  // namespace

void slide(const DistanceField& field, const Points& points, const Steps& steps, Pose& pose) {
  const Pose start = pose;
  const Matrix3& held = steps.held;
  const double shrink = std::pow(steps.last_scale_m / steps.first_scale_m, 1.0 / std::max(steps.iterations - 1, 1));
  double scale_m = steps.first_scale_m;
  for (int iteration = 0; iteration < steps.iterations; ++iteration, scale_m *= shrink) {
    Equations sums = normal_equations(field, points, pose, scale_m);
    const double x = pose[0] - start[0], y = pose[1] - start[1], yaw = wrap(pose[2] - start[2]);
    sums.a00 += held[0] + steps.damping;
    sums.a01 += held[1];
    sums.a02 += held[2];
    sums.a11 += held[4] + steps.damping;
    sums.a12 += held[5];
    sums.a22 += held[8] + steps.damping;
    sums.b0 += held[0] * x + held[1] * y + held[2] * yaw;
    sums.b1 += held[1] * x + held[4] * y + held[5] * yaw;
    sums.b2 += held[2] * x + held[5] * y + held[8] * yaw;
    const Pose step = solve(sums);
    for (std::size_t i = 0; i < 3; ++i) pose[i] -= step[i];
  }
  pose[2] = wrap(pose[2]);
}

Matrix3 information_at(const DistanceField& field, const Points& points, const Pose& pose, double scale_m) {
  const Equations e = normal_equations(field, points, pose, scale_m);
  return {e.a00, e.a01, e.a02, e.a01, e.a11, e.a12, e.a02, e.a12, e.a22};
}

GLASS_NAV_VECTORIZED double fit_at(const DistanceField& field, const Points& points, const Pose& pose, double scale_m) {
  const double square = scale_m * scale_m;
  Ends ends(points, pose);
  double total = 0.0;
  while (ends.next(field)) {
    for (std::size_t i = 0; i < ends.count; ++i) total += square / (square + ends.at.distance[i] * ends.at.distance[i]);
  }
  return total / static_cast<double>(points.count);
}

GLASS_NAV_VECTORIZED double known_fit_at(const DistanceField& field, const KnownArea& area, const Points& points,
                                         const Pose& pose, double scale_m, double unknown_fit) {
  const double square = scale_m * scale_m, unknown = area.has(kUnmapped, pose[0], pose[1]) ? 0.0 : unknown_fit;
  Ends ends(points, pose);
  double total = 0.0;
  while (ends.next(field)) {
    for (std::size_t i = 0; i < ends.count; ++i) {
      const double fit = square / (square + ends.at.distance[i] * ends.at.distance[i]);
      total += area.has(kKnown, ends.x_m[i], ends.y_m[i]) ? fit : unknown;
    }
  }
  return total / static_cast<double>(points.count);
}

}  // namespace glass_nav
