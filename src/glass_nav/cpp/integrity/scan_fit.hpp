/// How well does a scan determine its pose? The formulation is in localization/integrity/fit_information.py.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "../field/distance_field.hpp"
#include "../poses/matrix3.hpp"

namespace glass_nav {

/// End points of beams in the robot's frame, x and y in turn, by ascending angle; the lidar there, and the robot in
/// map.
struct SeenScan {
  const double* xy_m;
  std::size_t count;
  std::array<double, 2> laser_m;
  Vector3 map_from_base;
};

struct FitInformation {
  Matrix3 covariance;  // over x [m], y [m], yaw [rad], in map
  Vector3 offset;      // the pose that was looked at, less the one at which the scan fits best
  double share;        // of the beams, that ended at a wall
};

/// Learns how much map and lidar disagree, and says how well each scan determines its pose.
class ScanFit {
 public:
  /// resolution_m: of the map's cells. square: residuals of fitted scans are measured square to the walls.
  ScanFit(double resolution_m, bool square);

  /// beam_share: of all beams that the pose was fitted to, how many these are. worth: of the fit as evidence, up to 1;
  /// 0: the pose was not fitted to this scan.
  FitInformation of(const DistanceField& field, const SeenScan& scan, double beam_share, double worth);

 private:
  static constexpr int kSides = 8;  // directions that walls face
  enum Size { kOffset, kSide, kPiece, kBeam, kSizes };

  struct Beam;
  struct Piece;

  double variance(Size size) const;
  void add(Size size, double squares, double freedom);
  void learn_scale(const std::vector<Beam>& beams);
  void learn(const std::vector<Beam>& beams, const std::vector<Piece>& pieces);
  Matrix3 spread_of(const std::vector<Beam>& beams, const std::vector<Piece>& pieces, double beam_share) const;
  void widen(const DistanceField& field, const Vector3& map_from_base, const std::vector<Beam>& beams,
             const Matrix3& information, double lever_m, double worth_of_beam, Matrix3& covariance) const;
  double added_variance(const DistanceField& field, const Vector3& map_from_base, const std::vector<Beam>& beams,
                        const Matrix3& information, double lever_m, double worth_of_beam, const Vector3& axis,
                        double variance) const;

  bool square_;
  double edge_m_, before_m_;              // deviation of an edge drawn in whole cells; where the field is looked at
  double scale_m_;                        // of what is left between beams and walls
  std::array<double, kSizes> squares_{};  // what fits left, by the size of what errs together
  std::array<double, kSizes> freedom_{};  // beams, less what the fits took up
};

}  // namespace glass_nav
