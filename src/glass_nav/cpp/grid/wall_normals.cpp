#include "wall_normals.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace glass_nav {
namespace {

/// The occupied cells with a side towards a cell that is not occupied; outside the grid nothing is.
std::vector<std::uint8_t> boundary_of(const std::vector<std::uint8_t>& occupied, int width, int height) {
  std::vector<std::uint8_t> boundary(occupied.size(), 0);
  const auto at = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < width && y < height && occupied[x + static_cast<std::size_t>(y) * width] != 0;
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (!at(x, y)) continue;
      const bool surrounded = at(x - 1, y) && at(x + 1, y) && at(x, y - 1) && at(x, y + 1);
      boundary[x + static_cast<std::size_t>(y) * width] = surrounded ? 0 : 1;
    }
  }
  return boundary;
}

/// Weighted sums of the cell centres of one patch of wall, relative to its middle cell.
struct Moments {
  double weight = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0, yy = 0.0;

  void add(double w, double px, double py) {
    weight += w;
    x += w * px;
    y += w * py;
    xx += w * px * px;
    xy += w * px * py;
    yy += w * py * py;
  }
};

/// A straight line through the cells of a patch: principal axes of their centres.
struct Line {
  double mean_x = 0.0, mean_y = 0.0;
  double along_rad = 0.0;  // (-pi/2, pi/2]
  double linearity = 0.0;  // 0: the cells give no direction

  explicit Line(const Moments& m) : mean_x(m.x / m.weight), mean_y(m.y / m.weight) {
    const double xx = m.xx / m.weight - mean_x * mean_x;
    const double xy = m.xy / m.weight - mean_x * mean_y;
    const double yy = m.yy / m.weight - mean_y * mean_y;
    const double middle = 0.5 * (xx + yy), spread = std::hypot(0.5 * (xx - yy), xy);
    if (spread <= 1e-9) return;  // one cell, or a patch as wide as long
    along_rad = 0.5 * std::atan2(2.0 * xy, xx - yy);
    linearity = 2.0 * spread / (middle + spread);
  }

  double distance(double x, double y) const {
    return std::abs((y - mean_y) * std::cos(along_rad) - (x - mean_x) * std::sin(along_rad));
  }
};

/// Collects the boundary cells around one cell that are connected with it.
class Patch {
 public:
  Patch(const std::vector<std::uint8_t>& boundary, int width, int height)
      : boundary_(boundary), width_(width), height_(height) {}

  /// All cells within the radius. Each has the same weight: this fit must see corners and posts.
  Line shape_at(int x, int y) {
    Moments moments;
    collect(x, y, WallNormals::kRadiusCells, [](int, int) { return true; });
    for (const auto& [dx, dy] : found_) moments.add(1.0, dx, dy);
    return Line(moments);
  }

  /// The same wall over a longer stretch. Twice the length makes the staircase of cells a third as steep; the weight
  /// falls off towards the ends, so that no step there tilts the line. Cells that stick out, such as posts of a glass
  /// wall, are excluded from a second fit.
  Line refined(int x, int y, const Line& shape) {
    collect(x, y, WallNormals::kStretchCells, [&](int dx, int dy) { return shape.distance(dx, dy) <= kBesideLine; });
    const Line all = line_of(found_.size() + 1.0, shape);
    distances_.clear();
    for (const auto& [dx, dy] : found_) distances_.push_back(all.distance(dx, dy));
    const auto middle = distances_.begin() + static_cast<std::ptrdiff_t>(distances_.size() / 2);
    std::nth_element(distances_.begin(), middle, distances_.end());
    const Line flush = line_of(std::max(kSticksOut, 1.3 * *middle), all);
    return flush.linearity > 0.0 ? flush : all;
  }

 private:
  /// Through the cells found within a distance of another line.
  Line line_of(double within, const Line& other) const {
    constexpr double kRadiusSquare = WallNormals::kStretchCells * WallNormals::kStretchCells + 1.0;
    Moments moments;
    for (const auto& [dx, dy] : found_) {
      if (other.distance(dx, dy) <= within) moments.add(1.0 - (dx * dx + dy * dy) / kRadiusSquare, dx, dy);
    }
    return moments.weight > 0.0 ? Line(moments) : other;
  }

  static constexpr int kBridge = 2;           // cells; a gap of one missing cell does not divide a wall
  static constexpr double kBesideLine = 2.5;  // cells from the line: both faces of a wall three cells thick
  static constexpr double kSticksOut = 0.8;   // a cell this far from a thin wall is not part of it
  static constexpr int kReach = WallNormals::kStretchCells;
  static constexpr int kSide = 2 * kReach + 1;

  template <class Wanted>
  void collect(int x, int y, int radius, const Wanted& wanted) {
    seen_.fill(false);
    found_.clear();
    const auto visit = [&](int dx, int dy) {
      const int cx = x + dx, cy = y + dy;
      if (dx * dx + dy * dy > radius * radius || cx < 0 || cy < 0 || cx >= width_ || cy >= height_) return;
      bool& seen = seen_[(dy + kReach) * kSide + (dx + kReach)];
      if (seen || boundary_[cx + static_cast<std::size_t>(cy) * width_] == 0) return;
      seen = true;
      if (wanted(dx, dy) || (dx == 0 && dy == 0)) found_.push_back({dx, dy});
    };
    visit(0, 0);
    for (std::size_t i = 0; i < found_.size(); ++i) {
      const auto [dx, dy] = found_[i];
      for (int ny = dy - kBridge; ny <= dy + kBridge; ++ny) {
        for (int nx = dx - kBridge; nx <= dx + kBridge; ++nx) visit(nx, ny);
      }
    }
  }

  const std::vector<std::uint8_t>& boundary_;
  int width_, height_;
  std::array<bool, kSide * kSide> seen_{};
  std::vector<std::array<int, 2>> found_;
  std::vector<double> distances_;
};

WallNormals::Normal normal_at(int x, int y, Patch& patch) {
  constexpr double kWorthRefining = 0.7;  // below it there is no line to refine
  const Line shape = patch.shape_at(x, y);
  if (shape.linearity == 0.0) return WallNormals::none();
  const Line line = shape.linearity < kWorthRefining ? shape : patch.refined(x, y, shape);
  const double sign = line.along_rad > 0.0 ? 1.0 : -1.0;
  const double nx = sign * std::sin(line.along_rad), ny = -sign * std::cos(line.along_rad);
  return {static_cast<float>(nx), static_cast<float>(ny), static_cast<float>(shape.linearity),
          static_cast<float>(nx * line.mean_x + ny * line.mean_y)};
}

}  // namespace

template <class NormalAt>
void WallNormals::collect(const std::vector<std::uint8_t>& boundary, const NormalAt& normal_at) {
  boundary_.resize((boundary.size() + kBits - 1) / kBits);
  for (std::size_t cell = 0; cell < boundary.size(); ++cell) {
    if (cell % kBits == 0) before_.push_back(static_cast<std::uint32_t>(normals_.size()));
    if (boundary[cell] == 0) continue;
    boundary_[cell / kBits] |= std::uint64_t{1} << (cell % kBits);
    normals_.push_back(normal_at(static_cast<int>(cell % width_), static_cast<int>(cell / width_)));
  }
}

WallNormals::WallNormals(const std::vector<std::uint8_t>& occupied, int width, int height) : width_(width) {
  const std::vector<std::uint8_t> boundary = boundary_of(occupied, width, height);
  Patch patch(boundary, width, height);
  collect(boundary, [&](int x, int y) { return normal_at(x, y, patch); });
}

WallNormals::WallNormals(const std::vector<std::uint8_t>& occupied, int width, int height, const WallNormals& before,
                         const CellBox& changed)
    : width_(width) {
  constexpr int kReach = kStretchCells + 1;  // a changed cell makes the cells beside it boundary cells
  const std::vector<std::uint8_t> boundary = boundary_of(occupied, width, height);
  const CellBox near = changed.grown(kReach, kReach, kReach, kReach, width, height);
  Patch patch(boundary, width, height);
  collect(boundary,
          [&](int x, int y) { return near.contains(x, y) ? normal_at(x, y, patch) : before.at(y * width_ + x); });
}

}  // namespace glass_nav
