#include "pose_bins.hpp"

#include <cmath>
#include <unordered_map>

namespace glass_nav {
namespace {

struct Hash {
  std::size_t operator()(const Bin& bin) const {
    std::uint64_t sum = 0;
    for (const std::int64_t each : bin) sum = (sum ^ static_cast<std::uint64_t>(each)) * 0x9E3779B97F4A7C15u;
    return static_cast<std::size_t>(sum ^ (sum >> 32));
  }
};

std::int64_t floored(double value) { return static_cast<std::int64_t>(std::floor(value)); }

}  // namespace

FilledBins filled_bins(const double* poses, std::size_t count, const BinSize& size, std::int64_t yaw_bins) {
  FilledBins filled;
  filled.of_pose.resize(count);
  std::unordered_map<Bin, std::size_t, Hash> numbers;
  for (std::size_t i = 0; i < count; ++i, poses += 3) {
    Bin bin{floored(poses[0] / size.x_m), floored(poses[1] / size.y_m), floored(poses[2] / size.yaw_rad)};
    if (yaw_bins > 0) bin[2] = (bin[2] % yaw_bins + yaw_bins) % yaw_bins;
    if (i > 0 && bin == filled.bins[filled.of_pose[i - 1]]) {  // as resampled particles often are
      filled.of_pose[i] = filled.of_pose[i - 1];
      continue;
    }
    const auto found = numbers.emplace(bin, filled.bins.size());
    if (found.second) filled.bins.push_back(bin);
    filled.of_pose[i] = found.first->second;
  }
  return filled;
}

}  // namespace glass_nav
