/// Priors -> vote -> pull of neighbours: the shares of the soft vote. The formulation is in
/// localization/beam_classification/case_votes.py.
#pragma once

#include "case_priors.hpp"

namespace glass_nav {

struct SoftVote {
  PriorModel priors;
  double depth_share;  // of the thickness of a wall: how deep in it beams end
  double gate_m;       // a beam that ends farther from a reference, across the wall, does not belong to it
  double temper;       // of a sample's evidence
  double pull;         // log odds that equal cases of all neighbouring beams add
};

/// Writes shares as count_case_votes() does.
void vote_softly(const Offers& offers, const PoseView& view, const PaneModel& panes, const SoftVote& vote,
                 double* share);

}  // namespace glass_nav
