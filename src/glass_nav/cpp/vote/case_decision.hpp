/// Shares of the vote -> the case of each beam, with the range that is expected for it. The formulation is in
/// localization/beam_classification/case_votes.py.
#pragma once

#include <cstddef>
#include <cstdint>

#include "case_votes.hpp"

namespace glass_nav {

struct DecisionModel {
  double min_share;    // of the vote; a case with less is uncertain
  double gate_m;       // across a surface
  double depth_share;  // of the thickness of a wall: how deep in it beams end
  double min_cos;      // lower bound of cosines
};

/// Of each beam; the caller's arrays.
struct DecidedCases {
  std::uint8_t* beam_case;  // 0 uncertain, 1 to 4 by path
  double* expected_m;       // NaN: uncertain
  double* residual_m;       // measured less expected
  double* weight;           // share of the vote
};

/// The case with the highest share wins. Its range is that of the first sample, or, for a beam that passes an edge
/// there, that of the sample which explains it best.
void decide_cases(const double* share, const Offers& offers, const DecisionModel& model, const DecidedCases& out);

/// The same cases from a pose nearby, the first sample of the offers: out holds what was decided, and is changed.
/// A beam that passes an edge from there keeps its range; one that ends farther from its surface is uncertain.
void see_from(const Offers& offers, const DecisionModel& model, const DecidedCases& out);

}  // namespace glass_nav
