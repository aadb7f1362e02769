/// The normals of the walls of a grid.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "cell_box.hpp"

namespace glass_nav {

/// Normals of all occupied cells that a ray may meet first: those with a side towards a cell that is not occupied.
///
/// The line through the boundary cells connected with a cell within kRadiusCells tells whether there is a straight wall
/// (connected, so that the pane behind does not bend this one); where there is, the direction comes from the cells
/// along that line within kStretchCells, which is twice as precise.
class WallNormals {
 public:
  static constexpr int kRadiusCells = 8;
  static constexpr int kStretchCells = 16;

  struct Normal {
    float x, y;       // unit vector, x >= 0: the caller orients it to the ray; NaN where there is none
    float linearity;  // 1 - smaller / larger principal variance: 1 straight wall, 0 no direction at all
    float offset;     // from the centre of the cell to the line of the wall, along (x, y) [cells]; NaN where none is
  };

  WallNormals(const std::vector<std::uint8_t>& occupied, int width, int height);

  /// The same grid after cells in a box changed: only the normals near it are worked out.
  WallNormals(const std::vector<std::uint8_t>& occupied, int width, int height, const WallNormals& before,
              const CellBox& changed);

  static constexpr Normal none() {
    constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
    return {kNaN, kNaN, 0.0F, kNaN};
  }

  /// Normal of one cell; none() for a cell inside a wall or without neighbours.
  Normal at(std::int32_t cell) const {
    const std::size_t word = static_cast<std::size_t>(cell) / kBits;
    const std::uint64_t bit = std::uint64_t{1} << (static_cast<std::size_t>(cell) % kBits);
    if ((boundary_[word] & bit) == 0) return none();
    return normals_[before_[word] + set_bits(boundary_[word] & (bit - 1))];
  }

 private:
  static constexpr std::size_t kBits = 64;

  /// How many there are: in pairs, fours, bytes, and then all. Compilers call a function for that where they may not
  /// use the instruction.
  static std::size_t set_bits(std::uint64_t word) {
    word -= (word >> 1) & 0x5555555555555555U;
    word = (word & 0x3333333333333333U) + ((word >> 2) & 0x3333333333333333U);
    word = (word + (word >> 4)) & 0x0F0F0F0F0F0F0F0FU;
    return static_cast<std::size_t>((word * 0x0101010101010101U) >> 56);
  }

  template <class NormalAt>
  void collect(const std::vector<std::uint8_t>& boundary, const NormalAt& normal_at);

  // One cell in twenty is on a boundary: a bit for each cell, and how many are set in the words before.
  int width_;
  std::vector<std::uint64_t> boundary_;
  std::vector<std::uint32_t> before_;
  std::vector<Normal> normals_;  // of the boundary cells, ascending
};

}  // namespace glass_nav
