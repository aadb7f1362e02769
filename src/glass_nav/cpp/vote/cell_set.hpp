/// Some cells of a grid, and the number of each.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace glass_nav {

/// A bit for each cell of the grid, and how many are set in the words before.
class CellSet {
 public:
  static constexpr std::int64_t kNone = -1;

  /// @param cells  flat, ascending, each in [0, size)
  CellSet(const std::int64_t* cells, std::size_t count, std::int64_t size)
      : count_(count), bits_((static_cast<std::size_t>(size) + kBits - 1) / kBits, 0), before_(bits_.size(), 0) {
    for (std::size_t i = 0; i < count; ++i) bits_[cells[i] / kBits] |= std::uint64_t{1} << (cells[i] % kBits);
    std::uint32_t sum = 0;
    for (std::size_t word = 0; word < bits_.size(); ++word) {
      before_[word] = sum;
      sum += static_cast<std::uint32_t>(__builtin_popcountll(bits_[word]));
    }
  }

  std::size_t count() const { return count_; }

  /// How many of the cells are less than this one, which is one of them; kNone for any other.
  std::int64_t number(std::int64_t cell) const {
    const auto word = static_cast<std::size_t>(cell / kBits);
    if (cell < 0 || word >= bits_.size()) return kNone;
    const std::uint64_t bit = std::uint64_t{1} << (cell % kBits);
    if ((bits_[word] & bit) == 0) return kNone;
    return before_[word] + __builtin_popcountll(bits_[word] & (bit - 1));
  }

 private:
  static constexpr std::int64_t kBits = 64;

  std::size_t count_;
  std::vector<std::uint64_t> bits_;
  std::vector<std::uint32_t> before_;
};

}  // namespace glass_nav
