#include "pose_clusters.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

namespace glass_nav {
namespace {

using Bin = std::array<std::int64_t, 3>;  // ordered by x, y, yaw

/// Sets of bins, joined pair by pair; the name of a set is its smallest member.
class JoinedSets {
 public:
  explicit JoinedSets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), std::size_t{0}); }

  std::size_t name(std::size_t member) {
    while (parent_[member] != member) member = parent_[member] = parent_[parent_[member]];
    return member;
  }

  void join(std::size_t one, std::size_t other) {
    one = name(one);
    other = name(other);
    parent_[std::max(one, other)] = std::min(one, other);
  }

 private:
  std::vector<std::size_t> parent_;
};

std::int64_t round_trip(std::int64_t yaw, int bins) { return (yaw % bins + bins) % bins; }

}  // namespace

void label_clusters(const double* poses, std::size_t count, const PoseBins& bins, std::int32_t* label) {
  std::vector<Bin> bin_of(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto yaw = static_cast<std::int64_t>(std::floor(poses[3 * i + 2] / bins.yaw_rad));
    bin_of[i] = {static_cast<std::int64_t>(std::floor(poses[3 * i] / bins.x_m)),
                 static_cast<std::int64_t>(std::floor(poses[3 * i + 1] / bins.y_m)), round_trip(yaw, bins.yaw_bins)};
  }
  std::vector<Bin> filled = bin_of;
  std::sort(filled.begin(), filled.end());
  filled.erase(std::unique(filled.begin(), filled.end()), filled.end());
  const auto place = [&](const Bin& bin) { return std::lower_bound(filled.begin(), filled.end(), bin); };
  JoinedSets sets(filled.size());
  for (std::size_t i = 0; i < filled.size(); ++i) {
    for (std::int64_t dx = -1; dx <= 1; ++dx) {
      for (std::int64_t dy = -1; dy <= 1; ++dy) {
        for (std::int64_t dyaw = -1; dyaw <= 1; ++dyaw) {
          const Bin beside{filled[i][0] + dx, filled[i][1] + dy, round_trip(filled[i][2] + dyaw, bins.yaw_bins)};
          const auto found = place(beside);
          if (found != filled.end() && *found == beside) sets.join(i, static_cast<std::size_t>(found - filled.begin()));
        }
      }
    }
  }
  std::vector<std::int32_t> number(filled.size(), -1);
  std::int32_t clusters = 0;
  for (std::size_t i = 0; i < filled.size(); ++i) {
    const std::size_t name = sets.name(i);  // not after i: the smallest of its set
    if (name == i) number[i] = clusters++;
    number[i] = number[name];
  }
  for (std::size_t i = 0; i < count; ++i)
    label[i] = number[static_cast<std::size_t>(place(bin_of[i]) - filled.begin())];
}

}  // namespace glass_nav
