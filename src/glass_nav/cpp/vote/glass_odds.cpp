#include "glass_odds.hpp"

#include <algorithm>
#include <cmath>

namespace glass_nav {
namespace {

/// Over the crossings near one wall.
struct Sums {
  std::int64_t wall;
  double weight = 0.0;
  std::array<double, kQuestions> evidence{};
};

std::vector<Sums> sums_by_wall(const WallCells& walls, const Crossings& crossings, const GlassLearning& learning) {
  constexpr std::int64_t kReach = WallCells::kBorder;
  constexpr std::int32_t kNew = -1;
  std::vector<Sums> sums;
  std::vector<std::int32_t> place(walls.numbers.count(), kNew);  // of each wall in the sums
  for (std::size_t i = 0; i < crossings.count; ++i) {
    const std::int64_t centre = walls.with_border(crossings.cell[i]);
    for (std::int64_t down = -kReach; down <= kReach; ++down) {
      for (std::int64_t right = -kReach; right <= kReach; ++right) {
        const std::int64_t wall = walls.numbers.number(centre + down * walls.stride() + right);
        if (wall == CellSet::kNone) continue;
        std::int32_t& at = place[static_cast<std::size_t>(wall)];
        if (at == kNew) {
          at = static_cast<std::int32_t>(sums.size());
          sums.push_back({wall});
        }
        Sums& of_wall = sums[static_cast<std::size_t>(at)];
        const double weight = learning.spread[static_cast<std::size_t>(std::max(std::abs(down), std::abs(right)))];
        of_wall.weight += weight;
        for (std::size_t k = 0; k < kQuestions; ++k) of_wall.evidence[k] += weight * crossings.log_odds[k][i];
      }
    }
  }
  return sums;
}

}  // namespace

double chance_of(double log_odds) { return 1.0 / (1.0 + std::exp(-log_odds)); }

void learn_crossings(const WallCells& walls, const Crossings& crossings, const GlassLearning& learning,
                     const GlassMemory& memory) {
  for (const Sums& sums : sums_by_wall(walls, crossings, learning)) {
    for (std::size_t k = 0; k < kQuestions; ++k) {
      // Many beams of one scan at a wall cell are one piece of evidence.
      const double added = learning.scan_share[k] * (sums.evidence[k] / sums.weight) * std::min(sums.weight, 1.0);
      float& log_odds = memory.log_odds[k][sums.wall];
      log_odds = static_cast<float>(std::clamp(log_odds + added, -learning.limit, learning.limit));
    }
    memory.crossed[sums.wall] = true;
  }
}

bool is_gone(const WallCells& walls, const float* log_odds, const Openings& openings, std::int64_t cell,
             double axis_rad, bool opaque) {
  const auto odds_of = [&](std::int64_t wall) { return wall == CellSet::kNone ? 0.0 : double{log_odds[wall]}; };
  const double own = odds_of(walls.number(cell));
  if (opaque && chance_of(openings.opaque_prior + own) < openings.opaque_limit) return true;
  if (!(own < 0.0) || !std::isfinite(axis_rad)) return false;
  const double normal_rad = axis_rad - openings.grid_yaw_rad, cos = std::cos(normal_rad), sin = std::sin(normal_rad);
  const auto row = static_cast<double>(cell / walls.columns), column = static_cast<double>(cell % walls.columns);
  // What speaks most for or against an opening across the wall, since walls of cells are staircases.
  const auto odds_along = [&](int along) {
    double least = 0.0, most = 0.0;
    for (int across = -1; across <= 1; ++across) {
      const double down = std::nearbyint(row + along * cos + across * sin);
      const double right = std::nearbyint(column - along * sin + across * cos);
      const auto at_row = static_cast<std::int64_t>(std::clamp(down, 0.0, walls.rows - 1.0));
      const auto at_column = static_cast<std::int64_t>(std::clamp(right, 0.0, walls.columns - 1.0));
      const double odds = odds_of(walls.number(at_row * walls.columns + at_column));
      least = across == -1 ? odds : std::min(least, odds);
      most = across == -1 ? odds : std::max(most, odds);
    }
    return most > -least ? most : least;
  };
  double opening = odds_along(0);
  for (const int side : {-1, 1}) {
    double sum = 0.0, least = 0.0;
    for (int along = 1; along <= openings.reach; ++along) {
      sum += odds_along(side * along);
      least = std::min(least, sum);
    }
    opening += least;
  }
  return chance_of(openings.prior + opening / openings.spread) < openings.limit;
}

}  // namespace glass_nav
