#include "soft_vote.hpp"

#include <vector>

#include "neighbour_pull.hpp"

namespace glass_nav {
namespace {

// A beam that is called mirrored wrongly costs more than an uncertain one, and neighbours would only repeat it.
constexpr double kMirrorMinShare = 0.4;
constexpr std::size_t kUncertain = 0, kSpecular = 2;  // rows of the shares

}  // namespace

void vote_softly(const Offers& offers, const PoseView& view, const PaneModel& panes, const SoftVote& vote,
                 double* share) {
  const std::size_t beams = offers.beams;
  std::vector<double> prior((kPaths + kOthers) * beams);
  case_priors(offers, view, panes, vote.priors, vote.depth_share, prior.data());
  count_case_votes(
      offers,
      {prior.data(), vote.priors.uncertain, vote.depth_share, panes.sigma_m, vote.gate_m, panes.min_cos, vote.temper},
      share);
  std::vector<bool> doubtful(beams);
  for (std::size_t b = 0; b < beams; ++b) doubtful[b] = share[kSpecular * beams + b] < kMirrorMinShare;
  pull_neighbours(offers.measured_m, beams, vote.pull, share);
  for (std::size_t b = 0; b < beams; ++b) {
    if (!doubtful[b]) continue;
    share[kUncertain * beams + b] += share[kSpecular * beams + b];
    share[kSpecular * beams + b] = 0.0;
  }
}

}  // namespace glass_nav
