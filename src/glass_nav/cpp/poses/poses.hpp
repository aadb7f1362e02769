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

/// Moves what is given in b to a, one after the other; worked out once for each a_from_b that stays where it is in
/// memory.
class Motion {
 public:
  /// A point: two numbers.
  void point(const double* a_from_b, const double* point_b, double* point_a) {
    turn_to(a_from_b);
    point_a[0] = a_from_b[0] + cos_ * point_b[0] - sin_ * point_b[1];
    point_a[1] = a_from_b[1] + sin_ * point_b[0] + cos_ * point_b[1];
  }

  /// a_from_c of b_from_c: three numbers each.
  void pose(const double* a_from_b, const double* b_from_c, double* a_from_c) {
    point(a_from_b, b_from_c, a_from_c);
    a_from_c[2] = wrap(a_from_b[2] + b_from_c[2]);
  }

 private:
  void turn_to(const double* a_from_b) {
    if (a_from_b == turned_) return;
    turned_ = a_from_b;
    cos_ = std::cos(a_from_b[2]);
    sin_ = std::sin(a_from_b[2]);
  }

  const double* turned_ = nullptr;
  double cos_ = 1.0, sin_ = 0.0;
};

inline void invert(const double* a_from_b, double* b_from_a) {
  const double cos = std::cos(a_from_b[2]), sin = std::sin(a_from_b[2]);
  b_from_a[0] = -cos * a_from_b[0] - sin * a_from_b[1];
  b_from_a[1] = sin * a_from_b[0] - cos * a_from_b[1];
  b_from_a[2] = wrap(-a_from_b[2]);
}

}  // namespace glass_nav
