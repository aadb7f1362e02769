#include "pose_clusters.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "../poses/poses.hpp"

namespace glass_nav {
namespace {

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

/// The cluster of each bin, by the number of one of its bins.
std::vector<std::size_t> clusters_of(const std::vector<Bin>& bins, std::int64_t yaw_bins) {
  std::vector<std::size_t> order(bins.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&bins](std::size_t one, std::size_t other) { return bins[one] < bins[other]; });
  JoinedSets sets(bins.size());
  for (std::size_t i = 0; i < bins.size(); ++i) {
    for (std::int64_t dx = -1; dx <= 1; ++dx) {
      for (std::int64_t dy = -1; dy <= 1; ++dy) {
        for (std::int64_t dyaw = -1; dyaw <= 1; ++dyaw) {
          const Bin beside{bins[i][0] + dx, bins[i][1] + dy, (bins[i][2] + dyaw + yaw_bins) % yaw_bins};
          const auto found =
              std::lower_bound(order.begin(), order.end(), beside,
                               [&bins](std::size_t number, const Bin& bin) { return bins[number] < bin; });
          if (found != order.end() && bins[*found] == beside) sets.join(i, *found);
        }
      }
    }
  }
  std::vector<std::size_t> names(bins.size());
  for (std::size_t i = 0; i < bins.size(); ++i) names[i] = sets.name(i);
  return names;
}

}  // namespace

Moments moments_of(const double* poses, const double* weights, std::size_t count, const bool* members) {
  const auto counts = [members](std::size_t i) { return members == nullptr || members[i]; };
  double total = 0.0, number = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    if (!counts(i)) continue;
    total += weights[i];
    number += 1.0;
  }
  const auto weight = [&](std::size_t i) { return total > 0.0 ? weights[i] / total : 1.0 / number; };
  Moments result{};
  double cos = 0.0, sin = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    if (!counts(i)) continue;
    const double w = weight(i), *pose = poses + 3 * i;
    result.mean[0] += w * pose[0];
    result.mean[1] += w * pose[1];
    cos += w * std::cos(pose[2]);
    sin += w * std::sin(pose[2]);
  }
  result.mean[2] = std::atan2(sin, cos);
  for (std::size_t i = 0; i < count; ++i) {
    if (!counts(i)) continue;
    const double* pose = poses + 3 * i;
    result.covariance.add_outer({pose[0] - result.mean[0], pose[1] - result.mean[1], wrap(pose[2] - result.mean[2])},
                                weight(i));
  }
  return result;
}

double mark_best_cluster(const double* poses, const double* weights, std::size_t count, const BinSize& size,
                         std::int64_t yaw_bins, bool* members) {
  const FilledBins filled = filled_bins(poses, count, size, yaw_bins);
  const std::vector<std::size_t> cluster = clusters_of(filled.bins, yaw_bins);
  std::vector<double> share(filled.bins.size());
  for (std::size_t i = 0; i < count; ++i) share[cluster[filled.of_pose[i]]] += weights[i];
  const auto best = static_cast<std::size_t>(std::max_element(share.begin(), share.end()) - share.begin());
  for (std::size_t i = 0; i < count; ++i) members[i] = cluster[filled.of_pose[i]] == best;
  return share[best];
}

}  // namespace glass_nav
