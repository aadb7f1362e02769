/// Cells of a histogram over poses.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace glass_nav {

using Bin = std::array<std::int64_t, 3>;  // along x, y, yaw

struct BinSize {
  double x_m, y_m, yaw_rad;
};

/// The bins that poses fall in.
struct FilledBins {
  std::vector<Bin> bins;             // all different, as they were first met
  std::vector<std::size_t> of_pose;  // the number of each pose's bin
};

/// poses: x, y, yaw in turn. yaw_bins: they go round; 0: yaw does not.
FilledBins filled_bins(const double* poses, std::size_t count, const BinSize& size, std::int64_t yaw_bins);

}  // namespace glass_nav
