/// The four ranges that each beam of a scan may measure from each of some poses. The formulation is in
/// localization/beam_classification/expected_ranges.py.
#pragma once

#include <cstddef>
#include <cstdint>

#include "beam_needs.hpp"
#include "grid_raycaster.hpp"

namespace glass_nav {

/// What is to be expected.
struct Expectation {
  RayBatch rays;             // every sample looks along every beam; the first sample is the pose itself
  const double* measured_m;  // angle_count: not finite: no answer
  const double* reach_m;     // angle_count: how far the other samples look
  double gate_m;             // across a surface: one that is farther from the end of a beam is not asked for, except by
                             // the first sample; inf: all are asked for
  double depth_share;        // of the thickness of a wall: how deep in it beams end
  const std::int8_t* occupancy;  // of each cell of the grid: negative: unknown
  const float* thickness_m;      // of the wall at each cell
  SurfaceLimits limits;
  bool mirrored_by_line;  // mirrored ranges are those by the lines of the walls, else by their cells
  double grid_yaw;        // of the grid in the map [rad]
};

/// Where it goes. Row-major, owned by the caller; N samples, B beams.
struct ExpectedArrays {
  double* range_m;        // (4, N, B) inf where nothing is met
  double* cos;            // (4, N, B) of the incidence there; 1 without a normal
  float* thickness_m;     // (4, N, B) of the wall there
  std::int32_t* cell;     // (4, N, B) -1 where none
  double* incidence_rad;  // (B) of the first sample at its first surface; NaN without a normal. As all that follows
  double* line_m;         // (4, B) range by the lines of the walls, half a cell behind the near faces
  double* axis_rad;       // (4, B) axes of their normals in the map, of a mirrored wall that of its image; NaN: none
  bool* seen_side;        // (4, B) the side that the beam comes from is not unknown
};

void expect_ranges(const GridRaycaster& grid, const Expectation& wanted, const ExpectedArrays& out);

}  // namespace glass_nav
