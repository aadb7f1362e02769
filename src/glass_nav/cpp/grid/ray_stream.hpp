/// The rays of a batch of poses and beams, one after the other.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "grid_walk.hpp"

namespace glass_nav {

/// Unit vectors of the beams: one sine and cosine for each beam and each pose; their sums come by rotation.
class Beams {
 public:
  Beams(const double* angles, std::size_t count) : x_(count), y_(count) {
    for (std::size_t b = 0; b < count; ++b) {
      x_[b] = std::cos(angles[b]);
      y_[b] = std::sin(angles[b]);
    }
  }

  std::size_t count() const { return x_.size(); }
  double x(std::size_t b) const { return x_[b]; }
  double y(std::size_t b) const { return y_[b]; }

 private:
  std::vector<double> x_, y_;
};

/// The rays of consecutive poses.
class RayStream {
 public:
  RayStream(const double* first_pose, const Beams& beams, double resolution_m)
      : pose_(first_pose), beams_(beams), resolution_m_(resolution_m) {}

  /// True if the next ray starts from another place than the one before.
  bool at_new_origin() const { return beam_ == 0; }

  /// Index of the beam of the next ray.
  std::size_t beam() const { return beam_; }

  Ray next() {
    if (at_new_origin()) {
      ray_.x = pose_[0] / resolution_m_;
      ray_.y = pose_[1] / resolution_m_;
      cos_yaw_ = std::cos(pose_[2]);
      sin_yaw_ = std::sin(pose_[2]);
      pose_ += 3;
    }
    ray_.dx = cos_yaw_ * beams_.x(beam_) - sin_yaw_ * beams_.y(beam_);
    ray_.dy = sin_yaw_ * beams_.x(beam_) + cos_yaw_ * beams_.y(beam_);
    if (++beam_ == beams_.count()) beam_ = 0;
    return ray_;
  }

 private:
  const double* pose_;
  const Beams& beams_;
  double resolution_m_;
  std::size_t beam_ = 0;
  double cos_yaw_ = 1.0, sin_yaw_ = 0.0;
  Ray ray_{};
};

}  // namespace glass_nav
