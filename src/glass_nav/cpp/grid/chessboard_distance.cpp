#include "chessboard_distance.hpp"

#include <algorithm>
#include <cstddef>

namespace glass_nav {
namespace {

constexpr int kMost = 255;

/// Works out the edges in a box again: a square of edge n fits if squares of edge n - 1 fit in the three cells ahead.
/// An edge of 0 stays: the cell is blocked.
void fill(std::vector<std::uint8_t>& edge, int width, int height, const CellBox& box, bool minus_x, bool minus_y) {
  const std::vector<std::uint8_t> outside(width, kMost);
  const int first_x = minus_x ? box.x0 : box.x1 - 1, step_x = minus_x ? -1 : 1;  // towards the border that rays run to
  const bool has_next = minus_x ? box.x0 > 0 : box.x1 < width;
  for (int i = 0; i < box.y1 - box.y0; ++i) {
    const int y = minus_y ? box.y0 + i : box.y1 - 1 - i, y_ahead = minus_y ? y - 1 : y + 1;
    std::uint8_t* row = edge.data() + static_cast<std::ptrdiff_t>(y) * width;
    const bool has_ahead = y_ahead >= 0 && y_ahead < height;
    const std::uint8_t* ahead = has_ahead ? edge.data() + static_cast<std::ptrdiff_t>(y_ahead) * width : outside.data();
    int next = has_next ? row[first_x + step_x] : kMost, diagonal = has_next ? ahead[first_x + step_x] : kMost;
    for (int j = 0; j < box.x1 - box.x0; ++j) {
      const int x = first_x - j * step_x;
      const int fits = row[x] == 0 ? 0 : std::min(kMost, 1 + std::min({next, diagonal, int{ahead[x]}}));
      row[x] = static_cast<std::uint8_t>(fits);
      next = fits;
      diagonal = ahead[x];
    }
  }
}

}  // namespace

ChessboardDistance::ChessboardDistance(const std::vector<std::uint8_t>& blocked, int width, int height)
    : width_(width), height_(height) {
  for (auto& edge : edge_) edge.resize(blocked.size());
  redraw({0, 0, width, height}, blocked);
}

void ChessboardDistance::redraw(const CellBox& box, const std::vector<std::uint8_t>& blocked) {
  for (const bool minus_y : {false, true}) {
    for (const bool minus_x : {false, true}) {
      std::vector<std::uint8_t>& edge = edge_[2 * minus_y + minus_x];
      auto is_blocked = blocked.begin();
      for (int y = box.y0; y < box.y1; ++y) {
        std::uint8_t* row = edge.data() + static_cast<std::ptrdiff_t>(y) * width_;
        for (int x = box.x0; x < box.x1; ++x) row[x] = *is_blocked++ != 0 ? 0 : 1;
      }
      const CellBox behind = box.grown(minus_x ? 0 : kMost, minus_y ? 0 : kMost, minus_x ? kMost : 0,
                                       minus_y ? kMost : 0, width_, height_);
      fill(edge, width_, height_, behind, minus_x, minus_y);
    }
  }
}

}  // namespace glass_nav
