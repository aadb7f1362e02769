#include "scan_matcher.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <queue>
#include <utility>

namespace glass_nav {

ScanMatcher::ScanMatcher(const std::uint8_t* scores, const std::uint8_t* allowed, int height, int width)
    : width_(width), height_(height) {
  const auto cells = static_cast<std::size_t>(width) * height;
  scores_[0] = {width, height, 0, std::vector<std::uint8_t>(scores, scores + cells)};
  allowed_[0] = {width, height, 0, std::vector<std::uint8_t>(allowed, allowed + cells)};
  for (int level = 1; level <= kLevels; ++level) {
    scores_[level] = doubled(scores_[level - 1], level);
    allowed_[level] = doubled(allowed_[level - 1], level);
  }
}

ScanMatcher::Pooled ScanMatcher::doubled(const Pooled& half, int level) {
  const int border = (1 << level) - 1, step = 1 << (level - 1);
  Pooled whole{half.width - half.border + border, half.height - half.border + border, border, {}};
  whole.best.resize(static_cast<std::size_t>(whole.width) * whole.height);
  for (int y = 0; y < whole.height; ++y) {
    for (int x = 0; x < whole.width; ++x) {
      const int left = x - border, below = y - border;
      whole.best[static_cast<std::size_t>(y) * whole.width + x] =
          std::max({half.at(left, below), half.at(left + step, below), half.at(left, below + step),
                    half.at(left + step, below + step)});
    }
  }
  return whole;
}

std::int32_t ScanMatcher::sum(const Pooled& scores, const std::vector<Offset>& points, int row, int column) const {
  std::int32_t total = 0;
  for (const Offset& point : points) total += scores.at(column + point.x, row + point.y);
  return total;
}

/// The best position in the square, if it is better than `best` is; a square whose bound is lower is skipped.
void ScanMatcher::descend(const std::vector<Offset>& points, const Square& square, int level, Square& best) const {
  if (level == 0) {
    if (square.bound > best.bound) best = square;
    return;
  }
  const int below = level - 1, step = 1 << below;
  std::array<Square, 4> parts;
  std::size_t count = 0;
  for (const int up : {0, step}) {
    for (const int right : {0, step}) {
      const int row = square.row + up, column = square.column + right;
      if (row >= height_ || column >= width_ || allowed_[below].at(column, row) == 0) continue;
      const std::int32_t bound = sum(scores_[below], points, row, column);
      if (bound > best.bound) parts[count++] = {bound, square.heading, row, column};
    }
  }
  std::sort(parts.begin(), parts.begin() + count, [](const Square& a, const Square& b) { return b < a; });
  for (std::size_t i = 0; i < count; ++i) {
    if (parts[i].bound > best.bound) descend(points, parts[i], below, best);
  }
}

std::vector<Match> ScanMatcher::search(const double* points, std::size_t count, const double* headings_rad,
                                       std::size_t heading_count, std::size_t keep) const {
  if (count == 0 || keep == 0) return {};
  std::vector<std::vector<Offset>> turned(heading_count);
  std::vector<Square> squares;
  for (std::size_t heading = 0; heading < heading_count; ++heading) {
    const double cos = std::cos(headings_rad[heading]), sin = std::sin(headings_rad[heading]);
    for (std::size_t i = 0; i < count; ++i) {
      const double x = points[2 * i], y = points[2 * i + 1];
      turned[heading].push_back(
          {static_cast<int>(std::lround(cos * x - sin * y)), static_cast<int>(std::lround(sin * x + cos * y))});
    }
    for (int row = 0; row < height_; row += kBlock) {
      for (int column = 0; column < width_; column += kBlock) {
        if (allowed_[kLevels].at(column, row) == 0) continue;
        squares.push_back(
            {sum(scores_[kLevels], turned[heading], row, column), static_cast<std::int32_t>(heading), row, column});
      }
    }
  }
  std::make_heap(squares.begin(), squares.end());
  std::priority_queue<Square, std::vector<Square>, std::function<bool(const Square&, const Square&)>> kept(
      [](const Square& a, const Square& b) { return b < a; });  // the worst on top
  while (!squares.empty()) {
    std::pop_heap(squares.begin(), squares.end());
    const Square square = squares.back();
    squares.pop_back();
    const std::int32_t least = kept.size() < keep ? 0 : kept.top().bound;
    if (square.bound <= least) break;
    Square best{least, -1, 0, 0};
    descend(turned[square.heading], square, kLevels, best);
    if (best.heading < 0) continue;
    if (kept.size() == keep) kept.pop();
    kept.push(best);
  }
  std::vector<Match> found(kept.size());
  for (std::size_t i = found.size(); i-- > 0; kept.pop()) {
    const Square& at = kept.top();
    found[i] = {at.row, at.column, at.heading, static_cast<float>(at.bound) / static_cast<float>(count)};
  }
  return found;
}

}  // namespace glass_nav
