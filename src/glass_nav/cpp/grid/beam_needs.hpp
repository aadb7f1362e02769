/// What need be cast from poses near another one, whose surfaces are known?
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "grid_raycaster.hpp"
#include "wall_lines.hpp"

namespace glass_nav {

constexpr std::size_t kPathCount = 4;
enum Path : std::size_t {
  kFirst,
  kMirrored,
  kSecond,
  kThird
};  // to the first surface, mirrored there, to those behind

/// How far poses are from the first of them.
struct PoseSpread {
  double cells = 0.0, yaw_rad = 0.0;
};

/// What a beam met at the end of a path. Lengths are in cells.
struct SeenSurface {
  double range;  // inf where nothing is met
  double cos;    // of the incidence
  double thickness;
  WallLine line;
};

/// What one pose sees along its beams.
struct SeenSurfaces {
  std::size_t beams = 0;
  const double* angles = nullptr;                       // of the beams
  std::array<std::vector<SeenSurface>, kPathCount> at;  // by path and beam
};

/// How far from a surface across it a beam may end and still be of it. Lengths are in cells.
struct EndGate {
  double across;
  double depth_share;  // of the thickness of a wall: how deep in it beams end
};

/// How a beam ended. Lengths are in cells.
struct BeamEnd {
  double range;  // not finite: it did not return
  double reach;  // how far the poses nearby look along the beam
};

/// Neighbouring beams, at least one.
struct BeamStretch {
  std::size_t first = 0, last = 0;
};

/// What one beam needs.
struct BeamNeed {
  PathChoice paths;
  BeamStretch beside;     // the beams by which that was decided
  bool is_known = false;  // that there are such beams; else all paths are needed, or none
};

/// What each beam needs, by what the pose sees along it and along the beams beside it, as far as the spread turns and
/// moves it: paths to surfaces that may have ended it, and the first surface; none if it did not return. Where less
/// than its reach is enough, the reach is shortened.
std::vector<BeamNeed> needs_of(const SeenSurfaces& seen, const PoseSpread& spread, const EndGate& gate,
                               std::vector<BeamEnd>& ends);

}  // namespace glass_nav
