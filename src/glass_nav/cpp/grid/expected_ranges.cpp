#include "expected_ranges.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "ray_stream.hpp"
#include "straight_walls.hpp"
#include "wall_lines.hpp"

namespace glass_nav {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kBeside = 2.5;                         // cells in front of a surface: past the steps of its staircase
constexpr double kLineCells = 2.0, kGrazingCos = 0.02;  // a line lies so near to the cells that a beam meets
constexpr double kNowhere_m = 1e-9;
constexpr double kFace = 0.5;  // cells from the near face of a wall to its line

class ExpectedRanges {
 public:
  ExpectedRanges(const GridRaycaster& grid, const Expectation& wanted, const ExpectedArrays& out)
      : grid_(grid),
        wanted_(wanted),
        out_(out),
        lines_(grid.normals(), wanted.thickness_m, grid.width(), grid.resolution_m(), wanted.limits.min_linearity),
        directions_(wanted.rays.angles, wanted.rays.angle_count),
        samples_(wanted.rays.pose_count),
        beams_(wanted.rays.angle_count) {
    for (const double* pose = wanted.rays.poses; poses_.size() < samples_; pose += 3) {
      const double cell_m = grid.resolution_m();
      poses_.push_back({pose[0] / cell_m, pose[1] / cell_m, std::cos(pose[2]), std::sin(pose[2])});
    }
  }

  void find() {
    cast_from_pose();
    if (samples_ > 1) look_from_others();
    for (std::size_t b = 0; b < beams_; ++b) tell(b);
  }

 private:
  std::size_t index(std::size_t path, std::size_t sample, std::size_t beam) const {
    return (path * samples_ + sample) * beams_ + beam;
  }

  /// Of a sample, lengths in cells.
  Ray ray(std::size_t sample, std::size_t beam) const {
    const Ray& from = poses_[sample];  // its direction is that of the pose
    return {from.x, from.y, from.dx * directions_.x(beam) - from.dy * directions_.y(beam),
            from.dy * directions_.x(beam) + from.dx * directions_.y(beam)};
  }

  PathArrays paths_of(std::size_t sample) const {
    PathArrays to{};
    for (std::size_t path = 0; path < kPathCount; ++path) {
      to.range_m[path] = out_.range_m + index(path, sample, 0);
      to.cos[path] = out_.cos + index(path, sample, 0);
      to.cell[path] = out_.cell + index(path, sample, 0);
    }
    return to;
  }

  /// The first sample looks as far as the lidar does.
  void cast_from_pose() {
    RayBatch rays = wanted_.rays;
    rays.pose_count = 1;
    const std::vector<double> reach_m(beams_, rays.max_range_m);
    grid_.cast_paths(rays, reach_m.data(), nullptr, wanted_.limits, paths_of(0));
    const double cell_m = grid_.resolution_m();
    seen_.beams = beams_;
    seen_.angles = rays.angles;
    for (std::size_t path = 0; path < kPathCount; ++path) {
      seen_.at[path].reserve(beams_);
      for (std::size_t b = 0; b < beams_; ++b) {
        const std::size_t at = index(path, 0, b);
        const std::int32_t cell = out_.cell[at];
        const float thickness_m = cell < 0 ? 0.0F : wanted_.thickness_m[cell];
        out_.thickness_m[at] = thickness_m;
        seen_.at[path].push_back({0.0, out_.cos[at], thickness_m / cell_m, lines_.of(cell)});
        if (path == kMirrored && wanted_.mirrored_by_line) {
          mirror_by_line(at, seen_.at[kFirst][b].line, seen_.at[path][b].line, ray(0, b));
        }
        seen_.at[path][b].range = out_.range_m[at] / cell_m;
      }
    }
  }

  /// The range of a mirrored path by the lines of both walls, where it ends about there. The steps of a slanted mirror
  /// move the image by up to two cells.
  void mirror_by_line(std::size_t at, const WallLine& mirror, const WallLine& target, const Ray& from) {
    if (!mirror.straight || !target.straight) return;
    const MirroredRange by_line = mirrored_range(mirror, target, from);
    const double near = kLineCells * (1.0 + 2.0 * by_line.cos_mirror);
    const double off = std::abs(by_line.range - out_.range_m[at] / grid_.resolution_m());
    if (off * by_line.cos <= near && by_line.cos >= kGrazingCos)
      out_.range_m[at] = by_line.range * grid_.resolution_m();
  }

  struct MirroredRange {
    double range, cos_mirror, cos;  // to the near faces; of the incidences at the mirror and the target
  };

  static MirroredRange mirrored_range(const WallLine& mirror, const WallLine& target, const Ray& from) {
    const double into = mirror.projection(from), to_mirror = mirror.distance(from.x, from.y);
    const Ray image{from.x + 2.0 * to_mirror * mirror.nx, from.y + 2.0 * to_mirror * mirror.ny,
                    from.dx - 2.0 * into * mirror.nx, from.dy - 2.0 * into * mirror.ny};
    const double cos = target.projection(image);
    const double range = target.distance(image.x, image.y) / cos - kFace / std::max(std::abs(cos), kMinCos) -
                         2.0 * kFace * std::abs(into);
    return {range, std::abs(into), std::abs(cos)};
  }

  // -- the other samples

  void look_from_others() {
    see_nothing();
    needs_ = needs_of_beams();
    const StraightWalls walls = straight_walls();
    std::vector<std::size_t> straight, first, more;
    for (std::size_t b = 0; b < beams_; ++b) {
      const PathChoice& paths = needs_[b].paths;
      if (paths.surfaces == 0) continue;
      (is_straight(walls, b) ? straight : paths.surfaces == 1 && !paths.mirrored ? first : more).push_back(b);
    }
    look_along_lines(walls, straight);
    if (!first.empty()) cast_first_along(first);
    if (!more.empty()) cast_paths_along(more);
  }

  std::vector<BeamNeed> needs_of_beams() {
    reach_m_.assign(wanted_.reach_m, wanted_.reach_m + beams_);
    if (!std::isfinite(wanted_.gate_m)) return std::vector<BeamNeed>(beams_);
    const double cell_m = grid_.resolution_m();
    PoseSpread spread;
    const double* pose = wanted_.rays.poses;
    for (std::size_t n = 1; n < samples_; ++n) {
      const double* other = pose + 3 * n;
      spread.cells = std::max(spread.cells, std::hypot(other[0] - pose[0], other[1] - pose[1]) / cell_m);
      spread.yaw_rad = std::max(spread.yaw_rad, std::abs(std::remainder(other[2] - pose[2], 2.0 * kPi)));
    }
    std::vector<BeamEnd> ends(beams_);
    for (std::size_t b = 0; b < beams_; ++b) {
      ends[b] = {wanted_.measured_m[b] / cell_m, reach_m_[b] / cell_m};
    }
    std::vector<BeamNeed> needs = needs_of(seen_, spread, {wanted_.gate_m / cell_m, wanted_.depth_share}, ends);
    for (std::size_t b = 0; b < beams_; ++b) reach_m_[b] = ends[b].reach * cell_m;
    return needs;
  }

  StraightWalls straight_walls() const {
    std::vector<Ray> rays;
    rays.reserve(beams_);
    for (std::size_t b = 0; b < beams_; ++b) rays.push_back(ray(0, b));
    return {seen_,
            {out_.cell + index(kFirst, 0, 0), out_.cell + index(kMirrored, 0, 0), out_.cell + index(kSecond, 0, 0),
             out_.cell + index(kThird, 0, 0)},
            rays,
            grid_.width()};
  }

  static bool is_needed(std::size_t path, const PathChoice& paths) {
    constexpr std::array<int, kPathCount> kSurfaces{1, 0, 2, 3};  // up to that of the path
    return path == kMirrored ? paths.mirrored : paths.surfaces >= kSurfaces[path];
  }

  /// Whether all that a beam needs can be told by the lines of walls.
  bool is_straight(const StraightWalls& walls, std::size_t beam) const {
    const BeamNeed& need = needs_[beam];
    if (!need.is_known || (need.paths.mirrored && !wanted_.mirrored_by_line)) return false;
    for (std::size_t path = 0; path < kPathCount; ++path) {
      if (is_needed(path, need.paths) && !walls.one_wall(path, need.beside, beam)) return false;
    }
    return true;
  }

  void look_along_lines(const StraightWalls& walls, const std::vector<std::size_t>& beams) {
    for (std::size_t path = 0; path < kPathCount; ++path) {
      for (const std::size_t b : beams) {
        const std::int32_t cell = out_.cell[index(path, 0, b)];
        if (!is_needed(path, needs_[b].paths) || cell < 0) continue;
        const NearFace face = walls.face(path, needs_[b].beside, b);
        for (std::size_t n = 1; n < samples_; ++n) {
          const Ray from = ray(n, b);
          double range = 0.0, cos = 0.0;
          if (path == kMirrored) {
            const MirroredRange mirrored = mirrored_range(seen_.at[kFirst][b].line, face.line, from);
            range = mirrored.range;
            cos = mirrored.cos;
          } else {
            range = face.range(from);
            cos = std::abs(face.line.projection(from));
          }
          if (!(range > 0.0 && cos >= kGrazingCos)) continue;
          const std::size_t at = index(path, n, b);
          out_.range_m[at] = range * grid_.resolution_m();
          out_.cos[at] = cos;
          out_.cell[at] = cell;
          out_.thickness_m[at] = out_.thickness_m[index(path, 0, b)];
        }
      }
    }
  }

  /// What is not met is not written again.
  void see_nothing() {
    for (std::size_t path = 0; path < kPathCount; ++path) {
      const std::size_t from = index(path, 1, 0), count = (samples_ - 1) * beams_;
      std::fill_n(out_.range_m + from, count, kInfinite);
      std::fill_n(out_.cos + from, count, 1.0);
      std::fill_n(out_.cell + from, count, -1);
      std::fill_n(out_.thickness_m + from, count, 0.0F);
    }
  }

  /// The batch of the other samples along some beams only.
  struct SomeBeams {
    std::vector<double> angles, reach_m;
    std::vector<PathChoice> choices;
    RayBatch rays;
  };

  SomeBeams others_along(const std::vector<std::size_t>& beams) const {
    SomeBeams some{{}, {}, {}, wanted_.rays};
    for (const std::size_t b : beams) {
      some.angles.push_back(wanted_.rays.angles[b]);
      some.reach_m.push_back(std::max(reach_m_[b], kNowhere_m));
      some.choices.push_back(needs_[b].paths);
    }
    some.rays.poses += 3;
    some.rays.pose_count = samples_ - 1;
    some.rays.angles = some.angles.data();
    some.rays.angle_count = beams.size();
    return some;
  }

  /// To the first surfaces, where nothing behind matters.
  void cast_first_along(const std::vector<std::size_t>& beams) {
    const SomeBeams some = others_along(beams);
    const std::size_t count = beams.size();
    std::vector<double> range_m((samples_ - 1) * count);
    std::vector<std::int32_t> cell(range_m.size());
    grid_.cast_first(some.rays, some.reach_m.data(), range_m.data(), cell.data());
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t b = beams[i];
      WallNormals::Normal normal{};
      std::int32_t known = -1;  // the cell of that normal: samples mostly meet the same few
      for (std::size_t n = 1; n < samples_; ++n) {
        const std::size_t from = (n - 1) * count + i, at = index(kFirst, n, b);
        const std::int32_t met = cell[from];
        if (met < 0) continue;
        if (met != known) {
          normal = lines_.normal(met);
          known = met;
        }
        const bool straight = lines_.straight(normal);
        if (!straight && may_miss(n, b)) continue;
        out_.range_m[at] = range_m[from];
        out_.cell[at] = met;
        out_.thickness_m[at] = wanted_.thickness_m[met];
        if (!straight) continue;
        const Ray u = ray(n, b);
        out_.cos[at] = std::abs(normal.x * u.dx + normal.y * u.dy);
      }
    }
  }

  void cast_paths_along(const std::vector<std::size_t>& beams) {
    const SomeBeams some = others_along(beams);
    const std::size_t count = beams.size(), plane = (samples_ - 1) * count;
    std::vector<double> range_m(kPathCount * plane), cos(kPathCount * plane);
    std::vector<std::int32_t> cell(kPathCount * plane);
    PathArrays to{};
    for (std::size_t path = 0; path < kPathCount; ++path) {
      to.range_m[path] = range_m.data() + path * plane;
      to.cos[path] = cos.data() + path * plane;
      to.cell[path] = cell.data() + path * plane;
    }
    grid_.cast_paths(some.rays, some.reach_m.data(), some.choices.data(), wanted_.limits, to);
    for (std::size_t path = 0; path < kPathCount; ++path) {
      for (std::size_t n = 1; n < samples_; ++n) {
        const std::size_t from = path * plane + (n - 1) * count, row = index(path, n, 0);
        for (std::size_t i = 0; i < count; ++i) {
          if (cell[from + i] < 0) continue;
          out_.range_m[row + beams[i]] = range_m[from + i];
          out_.cos[row + beams[i]] = cos[from + i];
          out_.cell[row + beams[i]] = cell[from + i];
        }
      }
    }
    for (std::size_t n = 1; n < samples_; ++n) {
      for (const std::size_t b : beams) {
        if (may_miss(n, b)) miss_corners(n, b);
        const std::size_t mirrored = index(kMirrored, n, b);
        if (wanted_.mirrored_by_line && out_.cell[mirrored] >= 0) {
          mirror_by_line(mirrored, lines_.of(out_.cell[index(kFirst, n, b)]), lines_.of(out_.cell[mirrored]),
                         ray(n, b));
        }
        for (std::size_t path = 0; path < kPathCount; ++path) {
          const std::size_t at = index(path, n, b);
          if (out_.cell[at] >= 0) out_.thickness_m[at] = wanted_.thickness_m[out_.cell[at]];
        }
      }
    }
  }

  /// Half of the samples see past what has no normal, each of them along every other beam.
  static bool may_miss(std::size_t sample, std::size_t beam) { return (sample + beam) % 2 == 1; }

  /// Lets a beam pass first and second surfaces without a normal.
  void miss_corners(std::size_t sample, std::size_t beam) {
    const std::int32_t first = out_.cell[index(kFirst, sample, beam)], second = out_.cell[index(kSecond, sample, beam)];
    if (first < 0) return;
    if (second >= 0 && !lines_.straight(second)) miss(kSecond, sample, beam);
    if (!lines_.straight(first)) miss(kFirst, sample, beam);
  }

  /// Takes a surface out; what is behind it moves up.
  void miss(Path path, std::size_t sample, std::size_t beam) {
    constexpr std::array<std::size_t, 3> kOrder{kFirst, kSecond, kThird};
    for (std::size_t k = path == kFirst ? 0 : 1; k < kOrder.size(); ++k) {
      const std::size_t to = index(kOrder[k], sample, beam);
      const bool is_last = k + 1 == kOrder.size();
      const std::size_t from = is_last ? to : index(kOrder[k + 1], sample, beam);
      out_.range_m[to] = is_last ? kInfinite : out_.range_m[from];
      out_.cos[to] = is_last ? 1.0 : out_.cos[from];
      out_.cell[to] = is_last ? -1 : out_.cell[from];
    }
  }

  // -- details of the pose

  void tell(std::size_t beam) {
    const double cell_m = grid_.resolution_m();
    const Ray straight = ray(0, beam);
    const WallLine& first = seen_.at[kFirst][beam].line;
    const double into = first.projection(straight);
    const Ray mirrored{straight.x, straight.y, straight.dx - 2.0 * into * first.nx,
                       straight.dy - 2.0 * into * first.ny};
    const double first_axis = axis_rad(first);
    out_.incidence_rad[beam] = first.straight ? std::acos(std::min(out_.cos[index(kFirst, 0, beam)], 1.0)) : kNaN;
    for (std::size_t path = 0; path < kPathCount; ++path) {
      const std::size_t from = index(path, 0, beam), to = path * beams_ + beam;
      const std::int32_t cell = out_.cell[from];
      const WallLine& line = seen_.at[path][beam].line;
      const double range = seen_.at[path][beam].range, axis = path == kFirst ? first_axis : axis_rad(line);
      out_.seen_side[to] = cell < 0 || is_seen_side(cell, line, path == kMirrored ? mirrored : straight);
      if (path == kMirrored) {
        const double mirror_cos = out_.cos[index(kFirst, 0, beam)];
        const double line_m = range + kFace / std::max(out_.cos[from], kMinCos) + 2.0 * kFace * mirror_cos;
        out_.line_m[to] = line_m * cell_m;
        out_.axis_rad[to] = 2.0 * first_axis + kPi - axis;
      } else {
        out_.line_m[to] = range_by_line(line, straight, range) * cell_m;
        out_.axis_rad[to] = axis;
      }
    }
  }

  /// Of the normal in the map; NaN where there is no line.
  double axis_rad(const WallLine& line) const {
    return line.straight ? std::atan2(line.ny, line.nx) + wanted_.grid_yaw : kNaN;
  }

  /// At which a beam crosses the line of a wall, which it meets there; half a cell more than that where there is no
  /// line.
  static double range_by_line(const WallLine& line, const Ray& from, double range) {
    if (!line.straight) return range + kFace;
    const double into = line.projection(from), cos = std::abs(into), by_line = line.distance(from.x, from.y) / into;
    if (cos >= kGrazingCos && std::abs(by_line - range) * cos <= kLineCells) return by_line;
    return range + kFace / std::max(cos, kMinCos);
  }

  /// A mapper draws what it sees: the side of a wall that it did not see is not where the map has it.
  bool is_seen_side(std::int32_t cell, const WallLine& line, const Ray& towards) const {
    double dx = -towards.dx, dy = -towards.dy;
    if (line.straight) {
      const double sign = line.projection(towards) > 0.0 ? -1.0 : 1.0;
      dx = sign * line.nx;
      dy = sign * line.ny;
    }
    const double column = std::floor(cell % grid_.width() + 0.5 + kBeside * dx);
    const double row = std::floor(cell / grid_.width() + 0.5 + kBeside * dy);
    if (column < 0.0 || row < 0.0 || column >= grid_.width() || row >= grid_.height()) return false;
    return wanted_.occupancy[static_cast<std::size_t>(row) * grid_.width() + static_cast<std::size_t>(column)] >= 0;
  }

  const GridRaycaster& grid_;
  const Expectation& wanted_;
  const ExpectedArrays& out_;
  WallLines lines_;
  Beams directions_;
  std::vector<Ray> poses_;
  std::size_t samples_, beams_;
  SeenSurfaces seen_{};          // from the pose
  std::vector<double> reach_m_;  // of the other samples, as what they look for
  std::vector<BeamNeed> needs_;
};

}  // namespace

void expect_ranges(const GridRaycaster& grid, const Expectation& wanted, const ExpectedArrays& out) {
  ExpectedRanges(grid, wanted, out).find();
}

}  // namespace glass_nav
