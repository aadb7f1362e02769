#include "scan_fit.hpp"

#include <algorithm>
#include <cmath>

namespace glass_nav {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kFreeM = 2.0;                                          // FREE_M of the Python face
constexpr double kSameWallM = 0.5, kSameWallCos = 0.90630778703664996;  // of neighbouring beams: 25 degrees
constexpr double kPieceM = 1.0;                                         // of a wall: pieces err by themselves
constexpr double kBeforeWallM = 0.25;                                   // where the field is looked at
constexpr double kBeforeCells = 1.5;                                    // the same square to the wall
constexpr int kSquare = 2;                                              // looks until that is square to the wall
constexpr double kEdgeCells = 0.29;                                     // deviation of an edge drawn in whole cells
constexpr double kKernelScales = 3.0;                                   // residuals beyond are not of that wall
constexpr double kCloseM = 0.3;                                         // residuals that the scale is learnt from
constexpr double kNearM = 0.15;                                         // kernel where the scan may fit beside the pose
constexpr double kMadToDeviation = 1.4826;                              // of a normal distribution
constexpr double kMinDeviationM = 0.002, kMinSquareM = 0.0005;          // of walls and of their pieces
constexpr double kPriorWeight = 10.0, kMemory = 0.98;                   // beams that edge_m is worth; past per scan
constexpr double kFitted = 2.0;                                         // sides whose error the fit takes up
constexpr double kPriorBeams = 0.01;                                    // weight of kFreeM
constexpr double kLeastUnmapped = 1.0, kMostUnmapped = 4.0;             // beams that ended at another thing
constexpr double kCommon = 0.5;                                         // share of that in what all walls err by
constexpr double kAnotherM = 0.1;                                       // as far off, a beam may have met another thing
constexpr double kSmallest = 1e-9;
constexpr int kSteps = 10;  // to each side of the pose, along the direction that is constrained least
constexpr std::array<double, kSteps> kStepsM{0.04, 0.08, 0.13, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0};

double step_m(int number) { return number < 0 ? -kStepsM[-number - 1] : number > 0 ? kStepsM[number - 1] : 0.0; }

double square(double value) { return value * value; }

/// [m2] of a step, with such negative log likelihoods of the steps from -kSteps to kSteps.
double variance_of(const std::array<double, 2 * kSteps + 1>& loss) {
  double total = 0.0, squares = 0.0;
  for (int i = -kSteps; i <= kSteps; ++i) {
    const int left = std::max(i - 1, -kSteps), right = std::min(i + 1, kSteps);
    const double width_m = (step_m(right) - step_m(left)) / (right - left);
    const double likelihood = std::exp(-std::max(loss[i + kSteps] - loss[kSteps], 0.0)) * width_m;
    total += likelihood;
    squares += likelihood * square(step_m(i));
  }
  return squares / total;
}

}  // namespace

struct ScanFit::Beam {
  double arm_x, arm_y;        // from the robot to the end [m], in map's axes
  double normal_x, normal_y;  // away from the wall
  double residual_m;          // of the end behind the wall
  double steepness;           // of the field; 0: the beam ended far behind a wall
  double weight, near;        // with the kernel of the scan, and with that of a scan that may fit beside the pose
  int side;                   // that the wall faces
  Vector3 jacobian;           // of x [m], y [m], yaw times the lever [m]
};

struct ScanFit::Piece {
  std::size_t first, last;  // beams [first, last)
};

ScanFit::ScanFit(double resolution_m, bool square_to_walls)
    : square_(square_to_walls),
      edge_m_(kEdgeCells * resolution_m),
      before_m_(kBeforeCells * resolution_m),
      scale_m_(edge_m_) {
  squares_.fill(kPriorWeight * square(edge_m_));
  freedom_.fill(kPriorWeight);
}

FitInformation ScanFit::of(const DistanceField& field, const SeenScan& scan, double beam_share, double worth) {
  const bool matched = worth > 0.0;
  const Vector3& pose = scan.map_from_base;
  const double cos = std::cos(pose[2]), sin = std::sin(pose[2]);
  const int looks = matched && square_ ? kSquare : 0;
  const double laser_x = cos * scan.laser_m[0] - sin * scan.laser_m[1];
  const double laser_y = sin * scan.laser_m[0] + cos * scan.laser_m[1];
  std::vector<Beam> beams(scan.count);
  std::vector<Piece> pieces;
  double squared_arms = 0.0, along_wall_m = 0.0, part = 0.0;
  for (std::size_t i = 0; i < scan.count; ++i) {
    const double* end = scan.xy_m + 2 * i;
    Beam& beam = beams[i];
    beam.arm_x = cos * end[0] - sin * end[1];
    beam.arm_y = sin * end[0] + cos * end[1];
    squared_arms += square(beam.arm_x) + square(beam.arm_y);
    double along_x = beam.arm_x - laser_x, along_y = beam.arm_y - laser_y;
    const double range_m = std::max(std::sqrt(square(along_x) + square(along_y)), kSmallest);
    along_x /= range_m;
    along_y /= range_m;
    double before_x = -kBeforeWallM * along_x, before_y = -kBeforeWallM * along_y, slope = 0.0;
    Slope at{};
    for (int look = 0; look <= looks; ++look) {
      at = field.at(beam.arm_x + before_x + pose[0], beam.arm_y + before_y + pose[1]);
      slope = std::sqrt(square(at.along_x) + square(at.along_y));
      beam.normal_x = at.along_x / std::max(slope, kSmallest);
      beam.normal_y = at.along_y / std::max(slope, kSmallest);
      if (look == looks) break;
      before_x = before_m_ * beam.normal_x;  // not along the beam, which may pass by other things
      before_y = before_m_ * beam.normal_y;
    }
    beam.residual_m = before_x * beam.normal_x + before_y * beam.normal_y - at.distance;
    const double facing = -(along_x * beam.normal_x + along_y * beam.normal_y);
    beam.steepness = facing > 0.0 ? std::min(slope, 1.0) : 0.0;
    const int turn = static_cast<int>(std::nearbyint(std::atan2(at.along_y, at.along_x) * (kSides / (2.0 * kPi))));
    beam.side = (turn + kSides) % kSides;
    bool is_new = i == 0;
    if (i > 0) {
      const Beam& last = beams[i - 1];
      const double apart_m = std::sqrt(square(end[0] - end[-2]) + square(end[1] - end[-1]));
      const bool is_other =
          apart_m > kSameWallM || beam.normal_x * last.normal_x + beam.normal_y * last.normal_y < kSameWallCos;
      if (!is_other) along_wall_m += apart_m;
      const double now = std::floor(along_wall_m / kPieceM);
      is_new = is_other || (i > 1 && now > part);
      part = now;
    }
    if (is_new) pieces.push_back({i, i});
    pieces.back().last = i + 1;
  }
  if (matched) learn_scale(beams);
  const double kernel_m = kKernelScales * scale_m_, near_m = std::max(kernel_m, kNearM);
  const double lever_m = std::max(std::sqrt(squared_arms / static_cast<double>(scan.count)), 0.5);
  Matrix3 information, near_information = Matrix3::diagonal(kPriorBeams);
  Vector3 pull{};
  double near_total = 0.0;
  for (Beam& beam : beams) {
    const double squared = square(beam.residual_m);
    beam.near = square(square(near_m) / (square(near_m) + squared) * beam.steepness);
    beam.weight = matched ? square(square(kernel_m) / (square(kernel_m) + squared) * beam.steepness) : beam.near;
    beam.jacobian = {beam.normal_x, beam.normal_y, (beam.normal_y * beam.arm_x - beam.normal_x * beam.arm_y) / lever_m};
    information.add_outer(beam.jacobian, beam.weight);
    near_information.add_outer(beam.jacobian, beam.near);
    for (std::size_t k = 0; k < 3; ++k) pull[k] -= beam.near * beam.jacobian[k] * beam.residual_m;
    near_total += beam.near;
  }
  if (matched) learn(beams, pieces);
  const Matrix3 inverted = inverse(information + Matrix3::diagonal(kPriorBeams));
  Matrix3 covariance = inverted * spread_of(beams, pieces, beam_share) * inverted;
  if (matched) {
    if (square_) covariance = covariance + Matrix3::diagonal(kCommon * (variance(kSide) + variance(kPiece)));
    for (double& value : covariance.values) value /= worth;
    const double pieces_per_beam = static_cast<double>(pieces.size()) / static_cast<double>(beams.size());
    widen(field, pose, beams, information, lever_m, worth * pieces_per_beam, covariance);
  }
  Vector3 offset = inverse(near_information) * pull;
  offset[2] /= lever_m;
  for (std::size_t k = 0; k < 3; ++k) {
    covariance(2, k) /= lever_m;
    covariance(k, 2) /= lever_m;
  }
  return {covariance, offset, near_total / static_cast<double>(scan.count)};
}

void ScanFit::learn_scale(const std::vector<Beam>& beams) {
  std::vector<double> left_m;
  for (const Beam& beam : beams) {
    const double off_m = std::abs(beam.residual_m);
    if (off_m < kCloseM) left_m.push_back(off_m);
  }
  scale_m_ = edge_m_;
  if (left_m.empty()) return;
  const auto middle = left_m.begin() + static_cast<std::ptrdiff_t>(left_m.size() / 2);
  std::nth_element(left_m.begin(), middle, left_m.end());
  double median_m = *middle;
  if (left_m.size() % 2 == 0) median_m = 0.5 * (median_m + *std::max_element(left_m.begin(), middle));
  scale_m_ = std::max(edge_m_, kMadToDeviation * median_m);
}

/// Splits what is left after the fit into an offset, sides, pieces and beams: a nested analysis of variance.
void ScanFit::learn(const std::vector<Beam>& beams, const std::vector<Piece>& pieces) {
  double total = 0.0, offset_m = 0.0;
  for (const Beam& beam : beams) {
    total += beam.weight;
    offset_m += beam.weight * beam.residual_m;
  }
  if (total < 1.0) return;
  offset_m /= total;
  struct Sums {
    double weight = 0.0, residual = 0.0, squared = 0.0, alone = 0.0;  // alone: weight of one of its members
  };
  std::vector<Sums> of_piece(pieces.size());
  std::array<Sums, kSides> of_side{};
  std::array<double, kSides> of_one_beam{};  // by side: weight of one of its beams
  double beam_squares = 0.0, of_one = 0.0;
  for (std::size_t c = 0; c < pieces.size(); ++c) {
    Sums& sums = of_piece[c];
    for (std::size_t i = pieces[c].first; i < pieces[c].last; ++i) {
      sums.weight += beams[i].weight;
      sums.residual += beams[i].weight * beams[i].residual_m;
      sums.squared += square(beams[i].weight);
    }
    const double most = std::max(sums.weight, kSmallest);
    sums.residual /= most;
    sums.alone = sums.squared / most;
    of_one += sums.alone;
    for (std::size_t i = pieces[c].first; i < pieces[c].last; ++i)
      beam_squares += beams[i].weight * square(beams[i].residual_m - sums.residual);
    const int number = beams[pieces[c].first].side;
    Sums& side = of_side[static_cast<std::size_t>(number)];
    side.weight += sums.weight;
    side.residual += sums.weight * sums.residual;
    side.squared += square(sums.weight);
    of_one_beam[static_cast<std::size_t>(number)] += sums.weight * sums.alone;
  }
  add(kBeam, beam_squares, total - of_one);
  const double beam = variance(kBeam);
  double in_side = 0.0, in_side_of_one = 0.0, squared_sides = 0.0, weighted_sides = 0.0, weighted_of_one = 0.0;
  for (std::size_t s = 0; s < kSides; ++s) {
    Sums& side = of_side[s];
    const double most = std::max(side.weight, kSmallest);
    side.residual /= most;
    side.alone = side.squared / most;
    of_one_beam[s] /= most;
    in_side += side.alone;
    in_side_of_one += of_one_beam[s];
    squared_sides += square(side.weight);
    weighted_sides += side.weight * side.alone;
    weighted_of_one += side.weight * of_one_beam[s];
  }
  double piece_squares = 0.0, side_squares = 0.0;
  for (std::size_t c = 0; c < pieces.size(); ++c) {
    const Sums& side = of_side[static_cast<std::size_t>(beams[pieces[c].first].side)];
    piece_squares += of_piece[c].weight * square(of_piece[c].residual - side.residual);
  }
  for (const Sums& side : of_side) side_squares += side.weight * square(side.residual - offset_m);
  add(kPiece, piece_squares - beam * (of_one - in_side_of_one), total - in_side);
  side_squares -= variance(kPiece) * (in_side - weighted_sides / total);
  side_squares -= beam * (in_side_of_one - weighted_of_one / total);
  double mean_side = 0.0;
  for (const Sums& side : of_side) mean_side += side.weight / kSides;
  add(kSide, side_squares, total - squared_sides / total - kFitted * mean_side);
  add(kOffset, total * square(offset_m), total);
}

/// Covariance of what pulls at the pose: the sums of beams that err together, by how large such errors are.
Matrix3 ScanFit::spread_of(const std::vector<Beam>& beams, const std::vector<Piece>& pieces, double beam_share) const {
  const double kernel_m = kKernelScales * scale_m_;
  double beside = 0.0;
  for (const Beam& beam : beams) {
    const double off_m = std::abs(beam.residual_m);
    if (off_m > kernel_m && off_m < 3.0 * kernel_m && beam.steepness > 0.0) beside += 1.0;
  }
  const double unmapped = square(std::min(std::max(0.5 * beside, kLeastUnmapped), kMostUnmapped));
  Matrix3 spread = Matrix3::diagonal(square(kPriorBeams * kFreeM) + unmapped * (variance(kSide) + variance(kPiece)));
  Vector3 total{};
  std::array<Vector3, kSides> of_side{};
  const double of_beam = variance(kBeam) * beam_share, of_piece = variance(kPiece);
  for (const Piece& piece : pieces) {
    Vector3 sum{};
    for (std::size_t i = piece.first; i < piece.last; ++i) {
      const Beam& beam = beams[i];
      spread.add_outer(beam.jacobian, of_beam * square(beam.weight));
      for (std::size_t k = 0; k < 3; ++k) {
        const double weighted = beam.weight * beam.jacobian[k];
        sum[k] += weighted;
        of_side[static_cast<std::size_t>(beam.side)][k] += weighted;
        total[k] += weighted;
      }
    }
    spread.add_outer(sum, of_piece);
  }
  for (const Vector3& sum : of_side) spread.add_outer(sum, variance(kSide));
  spread.add_outer(total, variance(kOffset));
  return spread;
}

/// Adds to a covariance, in metres, what the loss along two axes adds to its linearization there: along its longest
/// one, and where the walls hold a robot that keeps its heading least.
void ScanFit::widen(const DistanceField& field, const Vector3& pose, const std::vector<Beam>& beams,
                    const Matrix3& information, double lever_m, double worth_of_beam, Matrix3& covariance) const {
  const Eigen3 found = eigen(covariance);
  const auto longest =
      static_cast<std::size_t>(std::max_element(found.values.begin(), found.values.end()) - found.values.begin());
  const Vector3 axis{found.axes(0, longest), found.axes(1, longest), found.axes(2, longest)};
  const double across_rad =
      0.5 * std::atan2(2.0 * information(0, 1), information(0, 0) - information(1, 1));  // where they hold it most
  const Vector3 slide{-std::sin(across_rad), std::cos(across_rad), 0.0};
  for (const Vector3& along : {axis, slide}) {
    const double added =
        added_variance(field, pose, beams, information, lever_m, worth_of_beam, along, dot(along, covariance * along));
    covariance.add_outer(along, std::max(0.0, added));
  }
}

/// [m2] along an axis, beyond its linearization and the variance there.
double ScanFit::added_variance(const DistanceField& field, const Vector3& pose, const std::vector<Beam>& beams,
                               const Matrix3& information, double lever_m, double worth_of_beam, const Vector3& axis,
                               double variance) const {
  const double kernel = square(std::max(kKernelScales * scale_m_, square_ ? kAnotherM : 0.0));
  const double share = 0.5 * square(kKernelScales) * worth_of_beam;
  const double curvature = share * dot(axis, information * axis) / kernel;
  std::array<double, 2 * kSteps + 1> loss{}, linearized{};
  for (int i = -kSteps; i <= kSteps; ++i) {
    const double step = step_m(i), cos = std::cos(step * axis[2] / lever_m), sin = std::sin(step * axis[2] / lever_m);
    const double x = pose[0] + step * axis[0], y = pose[1] + step * axis[1];
    double total = 0.0;
    for (const Beam& beam : beams) {
      const double squared =
          square(field.distance(x + cos * beam.arm_x - sin * beam.arm_y, y + sin * beam.arm_x + cos * beam.arm_y));
      total += squared / (squared + kernel);
    }
    loss[static_cast<std::size_t>(i + kSteps)] = share * total;
    linearized[static_cast<std::size_t>(i + kSteps)] = curvature * square(step);
  }
  return variance_of(loss) - std::max(variance_of(linearized), variance);
}

double ScanFit::variance(Size size) const {
  return std::max(squares_[size] / std::max(freedom_[size], 1e-3), square(square_ ? kMinSquareM : kMinDeviationM));
}

void ScanFit::add(Size size, double squares, double freedom) {
  squares_[size] = kMemory * squares_[size] + (1.0 - kMemory) * squares;
  freedom_[size] = kMemory * freedom_[size] + (1.0 - kMemory) * freedom;
}

}  // namespace glass_nav
