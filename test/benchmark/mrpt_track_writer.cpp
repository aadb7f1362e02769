// Writes a track and its map as MRPT files, for pf_localization.py, which compiles it.
//
//   mrpt_track_writer FOLDER    reads FOLDER/{map.bin,track.bin,config.ini}, writes
//   FOLDER/{map.gridmap.gz,track.rawlog}
#include <mrpt/config/CConfigFile.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/maps/COccupancyGridMap2D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/serialization/CArchive.h>

#include <cmath>
#include <exception>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <string>

using namespace mrpt;

namespace {

// A file of doubles in the machine's own byte order.
class Numbers {
 public:
  explicit Numbers(const std::string& name) : name_(name), file_(name, std::ios::binary) {}
  bool more() { return file_.peek() != std::ifstream::traits_type::eof(); }
  double next() {
    double value = 0.0;
    if (!file_.read(reinterpret_cast<char*>(&value), sizeof value))
      throw std::runtime_error(name_ + ": ends too early");
    return value;
  }
  poses::CPose2D pose() {
    const double x = next(), y = next(), yaw = next();
    return poses::CPose2D(x, y, yaw);
  }

 private:
  std::string name_;
  std::ifstream file_;
};

// resolution, columns, rows, then how free each cell is, row by row; the corner of cell (0, 0) is the origin.
void write_map(const std::string& folder) {
  Numbers numbers(folder + "/map.bin");
  const double resolution_m = numbers.next();
  const int columns = static_cast<int>(numbers.next()), rows = static_cast<int>(numbers.next());
  maps::COccupancyGridMap2D grid(0.0f, static_cast<float>(columns * resolution_m), 0.0f,
                                 static_cast<float>(rows * resolution_m), static_cast<float>(resolution_m));
  if (static_cast<int>(grid.getSizeX()) != columns || static_cast<int>(grid.getSizeY()) != rows)
    throw std::runtime_error("the grid of " + std::to_string(columns) + " x " + std::to_string(rows) +
                             " cells became " + std::to_string(grid.getSizeX()) + " x " +
                             std::to_string(grid.getSizeY()));
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) grid.setCell(column, row, static_cast<float>(numbers.next()));
  // a grid map carries likelihood options, which replace those of the program that loads it
  grid.likelihoodOptions.loadFromConfigFile(config::CConfigFile(folder + "/config.ini"),
                                            "MetricMap_occupancyGrid_00_likelihoodOpts");
  io::CFileGZOutputStream stream(folder + "/map.gridmap.gz");
  serialization::archiveFrom(stream) << grid;
}

// Of each scan: time, pose in the odometry, pose of the lidar's middle beam on the robot, aperture, whether the beams
// run to the left, longest range, how many ranges, the ranges: NaN where there is none.
void write_track(const std::string& folder) {
  Numbers numbers(folder + "/track.bin");
  io::CFileGZOutputStream stream(folder + "/track.rawlog");
  auto archive = serialization::archiveFrom(stream);
  while (numbers.more()) {
    auto odometry = obs::CObservationOdometry::Create();
    auto scan = obs::CObservation2DRangeScan::Create();
    odometry->timestamp = scan->timestamp = Clock::fromDouble(numbers.next());
    odometry->sensorLabel = "odometry";
    odometry->odometry = numbers.pose();
    scan->sensorLabel = "lidar";
    scan->setSensorPose(poses::CPose3D(numbers.pose()));
    scan->aperture = static_cast<float>(numbers.next());
    scan->rightToLeft = numbers.next() != 0.0;
    scan->maxRange = static_cast<float>(numbers.next());
    const auto beams = static_cast<size_t>(numbers.next());
    scan->resizeScan(beams);
    for (size_t beam = 0; beam < beams; ++beam) {
      const double range_m = numbers.next();
      const bool valid = std::isfinite(range_m);
      scan->setScanRange(beam, valid ? static_cast<float>(range_m) : scan->maxRange);
      scan->setScanRangeValidity(beam, valid);
    }
    archive << odometry << scan;
  }
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2) {
    std::cerr << "usage: mrpt_track_writer FOLDER\n";
    return 2;
  }
  try {
    write_map(arguments[1]);
    write_track(arguments[1]);
  } catch (const std::exception& problem) {
    std::cerr << "mrpt_track_writer: " << problem.what() << "\n";
    return 1;
  }
  return 0;
}
