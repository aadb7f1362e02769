#include "wall_normals.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace glass_nav {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr WallNormals::Normal kNone{std::numeric_limits<float>::quiet_NaN(), 0.0F};

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

/// Sums of the cell centres of one patch of wall, relative to its middle cell.
struct Moments {
  double count = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0, yy = 0.0;

  void add(double px, double py) {
    count += 1.0;
    x += px;
    y += py;
    xx += px * px;
    xy += px * py;
    yy += py * py;
  }
};

/// Collects the cells connected with one cell, within the radius around it.
class Patch {
 public:
  Patch(const std::vector<std::uint8_t>& boundary, int width, int height)
      : boundary_(boundary), width_(width), height_(height) {}

  Moments around(int x, int y) {
    seen_.fill(false);
    Moments moments;
    std::size_t filled = 0;
    visit(0, 0, filled);
    for (std::size_t i = 0; i < filled; ++i) {
      const auto [dx, dy] = found_[i];
      moments.add(dx, dy);
      for (int ny = dy - 1; ny <= dy + 1; ++ny) {
        for (int nx = dx - 1; nx <= dx + 1; ++nx) {
          if (belongs(x, y, nx, ny)) visit(nx, ny, filled);
        }
      }
    }
    return moments;
  }

 private:
  static constexpr int kRadius = WallNormals::kRadiusCells;
  static constexpr int kSide = 2 * kRadius + 1;

  static std::size_t slot(int dx, int dy) { return (dy + kRadius) * kSide + (dx + kRadius); }

  bool belongs(int x, int y, int dx, int dy) const {
    if (dx * dx + dy * dy > kRadius * kRadius || seen_[slot(dx, dy)]) return false;
    const int cx = x + dx, cy = y + dy;
    return cx >= 0 && cy >= 0 && cx < width_ && cy < height_ &&
           boundary_[cx + static_cast<std::size_t>(cy) * width_] != 0;
  }

  void visit(int dx, int dy, std::size_t& filled) {
    seen_[slot(dx, dy)] = true;
    found_[filled++] = {dx, dy};
  }

  const std::vector<std::uint8_t>& boundary_;
  int width_, height_;
  std::array<bool, kSide * kSide> seen_{};
  std::array<std::array<int, 2>, kSide * kSide> found_{};
};

WallNormals::Normal normal_of(const Moments& m) {
  const double mean_x = m.x / m.count, mean_y = m.y / m.count;
  const double xx = m.xx / m.count - mean_x * mean_x;
  const double xy = m.xy / m.count - mean_x * mean_y;
  const double yy = m.yy / m.count - mean_y * mean_y;
  const double middle = 0.5 * (xx + yy), spread = std::hypot(0.5 * (xx - yy), xy);
  if (spread <= 1e-9) return kNone;  // one cell, or as wide as long
  const double along = 0.5 * std::atan2(2.0 * xy, xx - yy);  // (-pi/2, pi/2]
  const double across = along > 0.0 ? along - 0.5 * kPi : along + 0.5 * kPi;
  return {static_cast<float>(across), static_cast<float>(2.0 * spread / (middle + spread))};
}

}  // namespace

WallNormals::WallNormals(const std::vector<std::uint8_t>& occupied, int width, int height) : width_(width) {
  const std::vector<std::uint8_t> boundary = boundary_of(occupied, width, height);
  Patch patch(boundary, width, height);
  row_begin_.reserve(height + 1);
  for (int y = 0; y < height; ++y) {
    row_begin_.push_back(static_cast<std::int32_t>(cells_.size()));
    for (int x = 0; x < width; ++x) {
      const std::int32_t cell = y * width + x;
      if (boundary[cell] == 0) continue;
      cells_.push_back(cell);
      normals_.push_back(normal_of(patch.around(x, y)));
    }
  }
  row_begin_.push_back(static_cast<std::int32_t>(cells_.size()));
}

WallNormals::Normal WallNormals::at(std::int32_t cell) const {
  const std::int32_t row = cell / width_;
  const auto begin = cells_.begin() + row_begin_[row], end = cells_.begin() + row_begin_[row + 1];
  const auto found = std::lower_bound(begin, end, cell);
  return found != end && *found == cell ? normals_[found - cells_.begin()] : kNone;
}

}  // namespace glass_nav
