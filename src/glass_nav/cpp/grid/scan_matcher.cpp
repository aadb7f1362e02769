#include "scan_matcher.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace glass_nav {
namespace {

constexpr std::size_t kAtOnce = 16;        // scores of a plane that are added up in the time of one other look-up
constexpr std::size_t kMaxPoints16 = 257;  // whose scores add up to 16 bits
constexpr int kHighest = 255;              // score of a point

int floor_div(int value, int by) { return value >= 0 ? value / by : -((-value + by - 1) / by); }

}  // namespace

MatchGrid::MatchGrid(const std::uint8_t* scores, const std::uint8_t* allowed, int height, int width)
    : width_(width), height_(height) {
  const auto cells = static_cast<std::size_t>(width) * height;
  scores_[0] = {width, height, 0, std::vector<std::uint8_t>(scores, scores + cells)};
  allowed_[0] = {width, height, 0, std::vector<std::uint8_t>(allowed, allowed + cells)};
  for (int level = 1; level <= kLevels; ++level) allowed_[level] = doubled(allowed_[level - 1]);
  for (int level = 1; level < kLevels; ++level) scores_[level] = doubled(scores_[level - 1]);
  blocks_ = sorted(doubled(scores_[kLevels - 1]));
}

MatchGrid::Pooled MatchGrid::doubled(const Pooled& half) {
  const int step = half.border + 1;
  Pooled whole{half.width + step, half.height + step, half.border + step, {}};
  whole.best.resize(static_cast<std::size_t>(whole.width) * whole.height);
  std::vector<std::uint8_t> columns(static_cast<std::size_t>(half.width));  // best of two cells above each other
  for (int y = 0; y < whole.height; ++y) {
    std::fill(columns.begin(), columns.end(), std::uint8_t{0});
    for (const int row : {y - step, y}) {
      if (row < 0 || row >= half.height) continue;
      const std::uint8_t* from = &half.best[static_cast<std::size_t>(row) * half.width];
      for (int x = 0; x < half.width; ++x) columns[x] = std::max(columns[x], from[x]);
    }
    std::uint8_t* to = &whole.best[static_cast<std::size_t>(y) * whole.width];
    std::copy(columns.begin(), columns.end(), to);
    for (int x = 0; x < half.width; ++x) to[x + step] = std::max(to[x + step], columns[x]);
  }
  return whole;
}

MatchGrid::Planes MatchGrid::sorted(const Pooled& pooled) {
  Planes planes{(pooled.width + pooled.border) / kBlock + 2, (pooled.height + pooled.border) / kBlock + 2, {}};
  const std::size_t size = static_cast<std::size_t>(planes.width) * planes.height;
  planes.best.resize(size * kBlock * kBlock);
  for (int y = 0; y < pooled.height; ++y) {
    const int cell_y = y - pooled.border + kBlock;
    for (int x = 0; x < pooled.width; ++x) {
      const int cell_x = x - pooled.border + kBlock;
      const std::size_t plane = static_cast<std::size_t>(cell_y % kBlock) * kBlock + cell_x % kBlock;
      planes.best[plane * size + static_cast<std::size_t>(cell_y / kBlock) * planes.width + cell_x / kBlock] =
          pooled.best[static_cast<std::size_t>(y) * pooled.width + x];
    }
  }
  return planes;
}

const std::uint8_t* MatchGrid::Planes::row(int x, int y, int block_row, int& first, int& count) const {
  const int right = floor_div(x, kBlock), up = floor_div(y, kBlock);
  const int from_row = block_row + up + 1;
  const int begin = std::max(first, -right - 1), end = std::min(first + count, width - right - 1);
  first = begin;
  count = from_row < 0 || from_row >= height ? 0 : std::max(0, end - begin);
  if (count == 0) return nullptr;
  const std::size_t plane = static_cast<std::size_t>(y - up * kBlock) * kBlock + (x - right * kBlock);
  return &best[(plane * height + from_row) * width + begin + right + 1];
}

ScanSearch::ScanSearch(std::shared_ptr<const MatchGrid> grid, const double* points, std::size_t count,
                       const double* headings_rad, std::size_t heading_count, std::size_t keep, double max_behind)
    : grid_(std::move(grid)),
      point_count_(count),
      keep_(keep),
      max_behind_(static_cast<std::int32_t>(std::lround(kHighest * static_cast<double>(count) * max_behind))),
      turned_(heading_count) {
  for (std::size_t heading = 0; heading < heading_count; ++heading) {
    const double cos = std::cos(headings_rad[heading]), sin = std::sin(headings_rad[heading]);
    for (std::size_t i = 0; i < count; ++i) {
      const double x = points[2 * i], y = points[2 * i + 1];
      turned_[heading].push_back(
          {static_cast<int>(std::lround(cos * x - sin * y)), static_cast<int>(std::lround(sin * x + cos * y))});
    }
  }
}

bool ScanSearch::advance(std::size_t look_ups) {
  if (point_count_ == 0 || keep_ == 0) return true;
  const std::size_t until = look_ups_ + std::min(look_ups, SIZE_MAX - look_ups_);
  const std::size_t rows = static_cast<std::size_t>(grid_->block_rows());
  for (; next_row_ < rows * turned_.size(); ++next_row_) {
    if (look_ups_ >= until) return false;
    bound_row(static_cast<std::int32_t>(next_row_ / rows), static_cast<int>(next_row_ % rows));
  }
  while (!squares_.empty()) {
    if (look_ups_ >= until) return false;
    const Square square = squares_.top();
    squares_.pop();
    const std::int32_t least = std::max(highest_ - max_behind_ - 1, kept_.size() < keep_ ? 0 : kept_.top().bound);
    if (square.bound <= least) {
      squares_ = {};
      break;
    }
    Square best{least, -1, 0, 0};
    descend(turned_[square.heading], square, MatchGrid::kLevels, best);
    if (best.heading < 0) continue;
    if (kept_.size() == keep_) kept_.pop();
    kept_.push(best);
    highest_ = std::max(highest_, best.bound);
  }
  return true;
}

std::vector<Match> ScanSearch::places() const {
  auto kept = kept_;
  while (!kept.empty() && kept.top().bound < highest_ - max_behind_) kept.pop();  // found before the best was
  std::vector<Match> found(kept.size());
  for (std::size_t i = found.size(); i-- > 0; kept.pop()) {
    const Square& at = kept.top();
    found[i] = {at.row, at.column, at.heading, static_cast<float>(at.bound) / static_cast<float>(point_count_)};
  }
  return found;
}

/// The bounds of the blocks of one row.
void ScanSearch::bound_row(std::int32_t heading, int block_row) {
  constexpr int kLevels = MatchGrid::kLevels, kBlock = MatchGrid::kBlock;
  const int columns = grid_->block_columns(), row = block_row * kBlock;
  const auto allowed = [&](int column) { return grid_->allowed_[kLevels].at(column * kBlock, row) != 0; };
  int first = 0, last = columns - 1;
  while (first <= last && !allowed(first)) ++first;
  while (first < last && !allowed(last)) --last;
  if (first > last) return;
  const std::vector<Offset>& points = turned_[heading];
  std::vector<std::int32_t> bounds(static_cast<std::size_t>(columns));
  std::vector<std::uint16_t> sums(static_cast<std::size_t>(columns));
  for (std::size_t done = 0; done < points.size(); done += kMaxPoints16) {
    std::fill(sums.begin(), sums.end(), std::uint16_t{0});
    for (std::size_t i = done; i < std::min(done + kMaxPoints16, points.size()); ++i) {
      int begin = first, count = last + 1 - first;
      const std::uint8_t* from = grid_->blocks_.row(points[i].x, points[i].y, block_row, begin, count);
      std::uint16_t* to = sums.data() + begin;
      for (int column = 0; column < count; ++column) to[column] = static_cast<std::uint16_t>(to[column] + from[column]);
    }
    for (int column = first; column <= last; ++column) bounds[column] += sums[column];
  }
  for (int column = first; column <= last; ++column) {
    if (bounds[column] > 0 && allowed(column)) squares_.push({bounds[column], heading, row, column * kBlock});
  }
  look_ups_ += points.size() * (static_cast<std::size_t>(last - first) / kAtOnce + 1);
}

std::int32_t ScanSearch::sum(const MatchGrid::Pooled& scores, const std::vector<Offset>& points, int row, int column) {
  std::int32_t total = 0;
  for (const Offset& point : points) total += scores.at(column + point.x, row + point.y);
  look_ups_ += points.size();
  return total;
}

/// The best position in the square, if it is better than `best` is; a square whose bound is lower is skipped.
void ScanSearch::descend(const std::vector<Offset>& points, const Square& square, int level, Square& best) {
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
      if (row >= grid_->height() || column >= grid_->width() || grid_->allowed_[below].at(column, row) == 0) continue;
      const std::int32_t bound = sum(grid_->scores_[below], points, row, column);
      if (bound > best.bound) parts[count++] = {bound, square.heading, row, column};
    }
  }
  std::sort(parts.begin(), parts.begin() + count, [](const Square& a, const Square& b) { return b < a; });
  for (std::size_t i = 0; i < count; ++i) {
    if (parts[i].bound > best.bound) descend(points, parts[i], below, best);
  }
}

}  // namespace glass_nav
