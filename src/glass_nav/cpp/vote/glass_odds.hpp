/// What beams tell of the wall cells of a map: can they be seen through, and are they still there? The formulation is
/// in localization/beam_classification/glass_map.py.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "cell_set.hpp"

namespace glass_nav {

/// The wall cells of a map, which is counted as if it had a border of kBorder cells.
struct WallCells {
  static constexpr std::int64_t kBorder = 2;

  std::int64_t rows, columns;  // without the border
  CellSet numbers;             // of the cells with the border

  /// The number of the wall at a cell of the map without its border; CellSet::kNone: there is none.
  std::int64_t number(std::int64_t cell) const { return cell < 0 ? CellSet::kNone : numbers.number(with_border(cell)); }
  std::int64_t with_border(std::int64_t cell) const {
    return (cell / columns + kBorder) * stride() + cell % columns + kBorder;
  }
  std::int64_t stride() const { return columns + 2 * kBorder; }
};

constexpr std::size_t kQuestions = 2;  // can be seen through, is there though it can

double chance_of(double log_odds);

/// What is remembered of each wall: two rows of log odds, and whether a beam crossed it.
struct GlassMemory {
  std::array<float*, kQuestions> log_odds;
  bool* crossed;
};

/// Beams of one scan that crossed walls or ended at them.
struct Crossings {
  std::size_t count;
  const std::int64_t* cell;                        // without the border, none negative
  std::array<const double*, kQuestions> log_odds;  // that each beam is evidence of
};

struct GlassLearning {
  std::array<double, WallCells::kBorder + 1> spread;  // weight of a crossing for cells 0, 1 and 2 away
  std::array<double, kQuestions> scan_share;          // of the evidence of a scan
  double limit;                                       // of what is remembered
};

void learn_crossings(const WallCells& walls, const Crossings& crossings, const GlassLearning& learning,
                     const GlassMemory& memory);

/// When a wall is gone.
struct Openings {
  double grid_yaw_rad;
  double prior;                       // log odds that what can be seen through is there
  double limit;                       // chance of being there below which it is gone
  double opaque_prior, opaque_limit;  // the same for what cannot be glass
  double spread;                      // so many cells learn from a beam
  int reach;                          // cells from one to the ends of its opening, at most
};

/// @param log_odds  of being there, of each wall
/// @param axis_rad  of the normal in the map; NaN: none
/// @param opaque    cannot be glass
bool is_gone(const WallCells& walls, const float* log_odds, const Openings& openings, std::int64_t cell,
             double axis_rad, bool opaque);

}  // namespace glass_nav
