/// COccupancyGridMap2D::simulateScanRay as it is.
#pragma once

#include <cstdint>

#include <mrpt/maps/COccupancyGridMap2D.h>

#include "../grid/free_ranges.hpp"

namespace glass_nav {

/// Faults of simulateScanRay (MRPT 2.1 to 2.14), and their remedies by GuidedRayMarcher and here:
/// - it samples every 0.8 cell and reports the sample, up to 0.8 cell late: the marcher gives the cell boundary;
/// - between two samples it slips through corners of cells, and so through thin walls: the marcher visits every cell up
///   to the reported range;
/// - its steps are rounded to 1/1024 cell, so long rays drift sideways and hit what the true ray passes: if the marcher
///   finds nothing where it reported a hit, it is asked again from there on;
/// - it makes max_range / resolution steps, so it stops at 0.8 max_range: it is given 1 / 0.8 of the range;
/// - with a threshold of 0.5 an unknown cell ends the ray as invalid: unknown cells pass its threshold here, and the
///   marcher stops at them where that is asked for.
class SimulatedRays : public FreeRanges {
 public:
  /// @param occupancy  height * width, row by row, 0 .. 100 percent or -1 unknown
  /// @param occupied_percent  a cell this occupied ends a beam
  SimulatedRays(const std::int8_t* occupancy, int height, int width, double resolution_m, int occupied_percent);

  double along(const Ray& ray, double t, double t_max) const override;
  void redraw(const std::int8_t* occupancy, const CellBox& box) override;

 private:
  int width_;
  double resolution_m_;
  int occupied_percent_;
  mrpt::maps::COccupancyGridMap2D map_;
};

}  // namespace glass_nav
