/// How far a ray may leap from each cell of a grid.
#pragma once

#include <cstdint>
#include <vector>

namespace glass_nav {

/// Chessboard distance from every cell to the nearest blocked one.
///
/// @param blocked  height * width cells, row by row; not 0: blocked
/// @return  as many bytes: 0 blocked, otherwise all cells nearer than the value are free; 255 means 255 or more
std::vector<std::uint8_t> chessboard_distance(const std::vector<std::uint8_t>& blocked, int width, int height);

}  // namespace glass_nav
