#include "case_votes.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace glass_nav {
namespace {

constexpr std::size_t kFirst = 0, kMirrored = 1, kSecond = 2;
constexpr std::size_t kGone = kPaths, kElsewhere = kPaths + 1;  // rows of the priors
constexpr double kMostSquare = 100.0;                           // of a residual in sigmas

/// Logarithm of a product, with a call of log() only now and then.
class LogProduct {
 public:
  void multiply(double factor) {
    const double before = product_;
    product_ *= factor;
    if (product_ > kLeast && product_ < kMost) return;
    log_ += std::log(before) + std::log(factor);
    product_ = 1.0;
  }
  double log() const { return log_ + std::log(product_); }

 private:
  static constexpr double kLeast = 1e-150, kMost = 1e150;

  double product_ = 1.0, log_ = 0.0;
};

/// Weights of the samples, sum 1, from their log evidence.
void weigh(std::vector<double>& log_evidence, double temper) {
  const double best = *std::max_element(log_evidence.begin(), log_evidence.end());
  double sum = 0.0;
  for (double& value : log_evidence) sum += value = std::exp(temper * (value - best));
  for (double& value : log_evidence) value /= sum;
}

}  // namespace

void count_case_votes(const Offers& offers, const Chances& chances, double* share) {
  const std::size_t beams = offers.beams, plane = offers.samples * beams;
  const double uncertain = chances.nothing * std::exp(-0.25 * std::pow(chances.gate_m / chances.sigma_m, 2));
  std::vector<double> joint((kPaths + 1) * plane);  // nothing, then the paths
  std::vector<double> weight(offers.samples, 0.0);
  for (std::size_t n = 0; n < offers.samples; ++n) {
    LogProduct evidence;
    for (std::size_t b = 0; b < beams; ++b) {
      const std::size_t i = n * beams + b;
      const double z = offers.measured_m[b];
      if (!std::isfinite(z)) continue;
      const double first_depth = chances.depth_share * offers.thickness_m[i];
      double total = 0.0, at_second = 0.0;
      for (std::size_t path = 0; path < kPaths; ++path) {
        const std::size_t at = path * plane + i;
        if (!std::isfinite(offers.range_m[at])) continue;
        const double cos = std::max(offers.cos[at], chances.min_cos);
        // Beams end that deep in the wall, along the normal.
        double across = (z - offers.range_m[at]) * cos - chances.depth_share * offers.thickness_m[at];
        if (path == kMirrored)
          across -= 2.0 * first_depth * offers.cos[kFirst * plane + i] * cos;  // a mirror lies that much deeper
        if (!(std::abs(across) <= chances.gate_m)) continue;
        // An error of the mirror's own place counts twice, along its normal.
        const double widening = path == kMirrored ? std::hypot(1.0, 2.0 * offers.cos[kFirst * plane + i]) : 1.0;
        const double sigmas = across / (chances.sigma_m * widening);
        const double density = std::exp(-0.5 * std::min(sigmas * sigmas, kMostSquare)) / widening;
        const double of_path = chances.prior[path * beams + b] * density;
        if (path == kSecond) at_second = density;
        joint[(path + 1) * plane + i] = of_path;
        total += of_path;
      }
      const double nothing =
          uncertain + chances.prior[kGone * beams + b] * at_second + chances.prior[kElsewhere * beams + b];
      joint[i] = nothing;
      evidence.multiply(total + nothing);
    }
    weight[n] = evidence.log();
  }
  weigh(weight, chances.temper);
  std::fill(share, share + (kPaths + 1) * beams, 0.0);
  for (std::size_t row = 0; row <= kPaths; ++row) {
    for (std::size_t n = 0; n < offers.samples; ++n) {
      const double* of_sample = joint.data() + row * plane + n * beams;
      for (std::size_t b = 0; b < beams; ++b) share[row * beams + b] += weight[n] * of_sample[b];
    }
  }
  for (std::size_t b = 0; b < beams; ++b) {
    double sum = 0.0;
    for (std::size_t row = 0; row <= kPaths; ++row) sum += share[row * beams + b];
    if (!(sum > 0.0)) {  // no answer: nothing to vote on
      share[b] = 1.0;
      continue;
    }
    for (std::size_t row = 0; row <= kPaths; ++row) share[row * beams + b] /= sum;
  }
}

}  // namespace glass_nav
