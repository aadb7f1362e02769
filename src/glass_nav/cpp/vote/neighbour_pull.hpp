/// Neighbouring beams mostly meet the same wall: their shares of the vote pull each other. The formulation is in
/// localization/beam_classification/case_votes.py.
#pragma once

#include <cstddef>

#include "case_votes.hpp"

namespace glass_nav {

/// Mean field of a chain, a few rounds. In place, on shares (kPaths + 1) * beams of count_case_votes().
/// @param measured_m  of the beams; not finite: no answer, which pulls nothing and is not pulled
/// @param pull  log odds that equal cases of all neighbouring beams add
void pull_neighbours(const double* measured_m, std::size_t beams, double pull, double* share);

}  // namespace glass_nav
