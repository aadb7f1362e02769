// Writes the MRPT files of this folder, which the tests of recording/ and world/ read.
// Compiled with find_package(mrpt-obs), find_package(mrpt-maps) and run once with the folder as its argument.
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/maps/COccupancyGridMap2D.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CActionRobotMovement3D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/serialization/CArchive.h>

#include <cmath>
#include <string>

using namespace mrpt;

namespace {

std::string folder;

struct File {
  explicit File(const std::string& name) : stream(folder + "/" + name), archive(serialization::archiveFrom(stream)) {}
  io::CFileGZOutputStream stream;
  decltype(serialization::archiveFrom(stream)) archive;
};

// Beam j of scan i measures 1 + i + j / 8 m; beam 2 got no answer.
obs::CObservation2DRangeScan::Ptr scan(int i, const std::string& label, const poses::CPose3D& pose, bool stamped) {
  auto out = obs::CObservation2DRangeScan::Create();
  out->sensorLabel = label;
  out->aperture = static_cast<float>(M_PI);
  out->maxRange = 20.0f;
  out->rightToLeft = true;
  out->setSensorPose(pose);
  out->timestamp = stamped ? Clock::fromDouble(1000.0 + i) : INVALID_TIMESTAMP;
  out->resizeScan(5);
  for (int j = 0; j < 5; ++j) {
    out->setScanRange(j, 1.0f + static_cast<float>(i) + static_cast<float>(j) / 8.0f);
    out->setScanRangeValidity(j, j != 2);
  }
  return out;
}

void observations(const std::string& name, bool odometry) {
  File file(name);
  const poses::CPose3D front(0.2, 0.1, 0.3, 0.5, 0, 0), rear(-0.2, 0, 0.3, M_PI, 0, M_PI);
  for (int i = 0; i < 4; ++i) {
    if (odometry) {
      auto reading = obs::CObservationOdometry::Create();
      reading->timestamp = Clock::fromDouble(1000.0 + i - 0.5);
      reading->odometry = poses::CPose2D(i, 0, 0.1 * i);
      file.archive << reading;
    }
    file.archive << scan(i, "front", front, true);
    if (odometry) file.archive << scan(i, "rear", rear, true);
  }
  if (odometry) {
    auto reading = obs::CObservationOdometry::Create();
    reading->timestamp = Clock::fromDouble(1003.0);
    reading->odometry = poses::CPose2D(4, 0, 0.4);
    file.archive << reading;
  }
}

// Frames with a step of 1 m ahead and 0.5 rad to the left between them; every second one as a 3D movement.
void paired(const std::string& name, bool stamped) {
  File file(name);
  for (int i = 0; i < 4; ++i) {
    obs::CSensoryFrame frame;
    frame.insert(scan(i, "laser", poses::CPose3D(0.1, 0, 0, 0, 0, 0), stamped));
    file.archive << frame;
    obs::CActionCollection actions;
    if (i % 2) {
      obs::CActionRobotMovement3D move;
      move.poseChange.mean = poses::CPose3D(1, 0, 0, 0.5, 0, 0);
      actions.insert(move);
    } else {
      obs::CActionRobotMovement2D move;
      obs::CActionRobotMovement2D::TMotionModelOptions model;
      move.computeFromOdometry(poses::CPose2D(1, 0, 0.5), model);
      actions.insert(move);
    }
    file.archive << actions;
  }
}

}  // namespace

int main(int, char** arguments) {
  folder = arguments[1];
  observations("observations.rawlog", true);
  observations("no_odometry.rawlog", false);
  paired("paired.rawlog", true);
  paired("paired_without_times.rawlog", false);
  {
    File file("no_scans.rawlog");
    auto comment = obs::CObservationComment::Create();
    comment->text = "nothing to see";
    file.archive << comment;
  }
  {
    // 3 columns, 2 rows, (0, 0) of the map in its middle row; occupied, free and unknown cells
    maps::COccupancyGridMap2D grid(-1.0f, 0.5f, -0.5f, 0.5f, 0.5f);
    grid.fill(0.5f);
    grid.setCell(0, 0, 0.01f);
    grid.setCell(1, 0, 0.99f);
    grid.setCell(2, 1, 0.3f);
    File file("small.gridmap.gz");
    file.archive << grid;
  }
}
