#include "chessboard_distance.hpp"

#include <algorithm>
#include <cstddef>

namespace glass_nav {
namespace {

constexpr int kMost = 255;

/// A square of edge n fits if squares of edge n - 1 fit in the three cells ahead.
std::vector<std::uint8_t> squares(const std::vector<std::uint8_t>& blocked, int width, int height, bool minus_x,
                                  bool minus_y) {
  std::vector<std::uint8_t> edge(blocked.size());
  const std::vector<std::uint8_t> outside(width, kMost);
  const std::uint8_t* ahead = outside.data();  // the row nearer to the border that the ray runs to
  for (int i = 0; i < height; ++i) {
    const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(minus_y ? i : height - 1 - i) * width;
    int next = kMost, diagonal = kMost;
    for (int j = 0; j < width; ++j) {
      const int x = minus_x ? j : width - 1 - j;
      const int fits = blocked[row + x] != 0 ? 0 : std::min(kMost, 1 + std::min({next, diagonal, int{ahead[x]}}));
      edge[row + x] = static_cast<std::uint8_t>(fits);
      next = fits;
      diagonal = ahead[x];
    }
    ahead = edge.data() + row;
  }
  return edge;
}

}  // namespace

ChessboardDistance::ChessboardDistance(const std::vector<std::uint8_t>& blocked, int width, int height) {
  for (const bool minus_y : {false, true}) {
    for (const bool minus_x : {false, true}) {
      edge_[2 * minus_y + minus_x] = squares(blocked, width, height, minus_x, minus_y);
    }
  }
}

}  // namespace glass_nav
