// MRPT's own files as plain vectors: .rawlog (a recorded robot) and .gridmap (an occupancy grid).
//
// One source for MRPT 2.1 to 2.14. Everything a caller can get wrong is a std::invalid_argument of one
// line without the file's name (the caller knows it); nothing is written to stderr.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace glass_nav {

// The laser scans and the odometry of one rawlog, in the order of the file.
struct Rawlog {
  // Of S scans. ranges and valid hold all scans one after the other, beams[i] values each.
  std::vector<std::int64_t> stamps_ns;  // -1: the file has no time for this scan
  std::vector<std::int64_t> beams;
  std::vector<float> ranges_m;
  std::vector<std::uint8_t> valid;  // 0: MRPT marked the range as no answer
  std::vector<double> first_angle_rad, angle_step_rad, range_max_m;
  std::vector<std::array<double, 6>> sensor_pose;  // x y z [m] yaw pitch roll [rad] on the robot
  std::vector<std::string> labels;                 // the sensor's name
  std::vector<std::int64_t> odometry_index;        // last odometry before the scan, -1: none yet

  // Of O odometry readings: poses in the odometry's own frame.
  std::vector<std::int64_t> odometry_stamps_ns;  // -1: no time of its own
  std::vector<std::array<double, 3>> odometry;

  std::map<std::string, std::int64_t> objects;  // class name -> how many were met
  bool paired = false;  // sensory frames with actions between them, rather than single observations
  std::string broken;   // why reading stopped before the end of the file; empty: it did not
};

// Reads what can be read; a file cut short gives what it holds, with `broken` set.
// Throws std::invalid_argument if the file cannot be opened or does not start with an MRPT object.
Rawlog read_rawlog(const std::string& path);

struct GridFile {
  std::int64_t rows = 0, columns = 0;
  double resolution_m = 0.0, x_min_m = 0.0, y_min_m = 0.0;
  std::vector<std::int8_t> occupancy;  // rows x columns: percent, -1 where the grid has no opinion
};

// Throws std::invalid_argument if the file is not one whole COccupancyGridMap2D.
GridFile read_grid_map(const std::string& path);

}  // namespace glass_nav
