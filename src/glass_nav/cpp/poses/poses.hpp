/// Rigid motions of the plane: x [m], y [m], yaw [rad].
#pragma once

#include <cmath>

namespace glass_nav {

/// The same angle in [-pi, pi); NaN stays NaN.
inline double wrap(double angle_rad) {
  constexpr double kPi = 3.14159265358979323846;
  const double whole_turns = std::floor((angle_rad + kPi) * (0.5 / kPi));
  const double wrapped = angle_rad - 2.0 * kPi * whole_turns;
  return wrapped < -kPi ? -kPi : wrapped;  // a last bit below is not let through
}

/// a_from_c = a_from_b, b_from_c: three numbers each.
inline void compose(const double* a_from_b, const double* b_from_c, double* a_from_c) {
  const double cos = std::cos(a_from_b[2]), sin = std::sin(a_from_b[2]);
  const double x = a_from_b[0] + cos * b_from_c[0] - sin * b_from_c[1];
  const double y = a_from_b[1] + sin * b_from_c[0] + cos * b_from_c[1];
  a_from_c[2] = wrap(a_from_b[2] + b_from_c[2]);
  a_from_c[0] = x;
  a_from_c[1] = y;
}

inline void invert(const double* a_from_b, double* b_from_a) {
  const double cos = std::cos(a_from_b[2]), sin = std::sin(a_from_b[2]);
  b_from_a[0] = -cos * a_from_b[0] - sin * a_from_b[1];
  b_from_a[1] = sin * a_from_b[0] - cos * a_from_b[1];
  b_from_a[2] = wrap(-a_from_b[2]);
}

/// A point: two numbers.
inline void transform_point(const double* a_from_b, const double* point_b, double* point_a) {
  const double cos = std::cos(a_from_b[2]), sin = std::sin(a_from_b[2]);
  point_a[0] = a_from_b[0] + cos * point_b[0] - sin * point_b[1];
  point_a[1] = a_from_b[1] + sin * point_b[0] + cos * point_b[1];
}

}  // namespace glass_nav
