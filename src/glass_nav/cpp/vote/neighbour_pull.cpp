#include "neighbour_pull.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace glass_nav {
namespace {

constexpr std::size_t kReach = 2;  // beams to either side
constexpr int kRounds = 3;
constexpr std::size_t kRows = kPaths + 1;
constexpr double kLeastShare = 1e-6;

using Shares = std::array<double, kRows>;

}  // namespace

void pull_neighbours(const double* measured_m, std::size_t beams, double pull, double* share) {
  std::vector<Shares> alone(beams), belief(beams), next(beams);
  for (std::size_t b = 0; b < beams; ++b) {
    for (std::size_t row = 0; row < kRows; ++row) {
      belief[b][row] = share[row * beams + b];
      alone[b][row] = belief[b][row] + kLeastShare;
    }
  }
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t b = 0; b < beams; ++b) {
      Shares around{};
      double count = 0.0;
      for (std::size_t i = b < kReach ? 0 : b - kReach; i <= std::min(b + kReach, beams - 1); ++i) {
        if (i == b || !std::isfinite(measured_m[i])) continue;
        for (std::size_t row = 0; row < kRows; ++row) around[row] += belief[i][row];
        count += 1.0;
      }
      double sum = 0.0;
      for (std::size_t row = 0; row < kRows; ++row) {
        const double drawn = around[row] > 0.0 ? std::exp(pull * around[row] / count) : 1.0;
        sum += next[b][row] = alone[b][row] * drawn;
      }
      for (double& value : next[b]) value /= sum;
    }
    belief.swap(next);
  }
  for (std::size_t b = 0; b < beams; ++b) {
    if (!std::isfinite(measured_m[b])) continue;
    for (std::size_t row = 0; row < kRows; ++row) share[row * beams + b] = belief[b][row];
  }
}

}  // namespace glass_nav
