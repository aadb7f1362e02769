#include "distance_field.hpp"

#include <algorithm>
#include <cstddef>

namespace glass_nav {
namespace {

constexpr std::uint8_t kFar = 255;

std::uint8_t one_more(std::uint8_t distance) { return distance == kFar ? kFar : distance + 1; }

/// Lowers each cell of `row` to one more than its neighbours in the row before it and than its predecessor;
/// `step` is the direction of the sweep along the row.
void sweep_row(std::uint8_t* row, const std::uint8_t* before, int width, int step) {
  const int first = step > 0 ? 0 : width - 1;
  for (int i = 0, x = first; i < width; ++i, x += step) {
    std::uint8_t nearest = kFar;
    if (before != nullptr) {
      nearest = before[x];
      if (x > 0) nearest = std::min(nearest, before[x - 1]);
      if (x + 1 < width) nearest = std::min(nearest, before[x + 1]);
    }
    if (i > 0) nearest = std::min(nearest, row[x - step]);
    row[x] = std::min(row[x], one_more(nearest));
  }
}

}  // namespace

std::vector<std::uint8_t> chessboard_distance(const std::vector<std::uint8_t>& blocked, int width, int height) {
  std::vector<std::uint8_t> distance(blocked.size());
  std::transform(blocked.begin(), blocked.end(), distance.begin(),
                 [](std::uint8_t b) { return b != 0 ? std::uint8_t{0} : kFar; });
  // Two sweeps are exact for this metric: upwards with the neighbours below, downwards with those above.
  const auto row = [&](int y) { return distance.data() + static_cast<std::ptrdiff_t>(y) * width; };
  for (int y = 0; y < height; ++y) sweep_row(row(y), y > 0 ? row(y - 1) : nullptr, width, +1);
  for (int y = height - 1; y >= 0; --y) sweep_row(row(y), y + 1 < height ? row(y + 1) : nullptr, width, -1);
  return distance;
}

}  // namespace glass_nav
