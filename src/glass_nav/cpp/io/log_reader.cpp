#include "log_reader.hpp"

#include <mrpt/io/CFileGZInputStream.h>
#include <mrpt/io/CStream.h>
#include <mrpt/maps/COccupancyGridMap2D.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CActionRobotMovement3D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/poses/CPose2D.h>
#include <mrpt/poses/CPose3D.h>
#include <mrpt/serialization/CArchive.h>
#include <mrpt/serialization/CSerializable.h>

#include <cmath>
#include <cstddef>
#include <stdexcept>

namespace glass_nav {
namespace {

using mrpt::serialization::CSerializable;

// Counts what is read, because MRPT reports the end of a file and a file cut within an object alike.
class CountingStream : public mrpt::io::CStream {
 public:
  explicit CountingStream(mrpt::io::CStream& source) : source_(source) {}
  std::size_t Read(void* buffer, std::size_t count) override {
    std::size_t got = source_.Read(buffer, count);
    if (got > count) got = 0;  // zlib's -1 for damaged data, converted to unsigned
    total_ += got;
    ran_out_ = ran_out_ || got < count;
    return got;
  }
  std::size_t Write(const void*, std::size_t) override { return 0; }
  std::uint64_t Seek(std::int64_t, CStream::TSeekOrigin) override { return total_; }
  std::uint64_t getTotalBytesCount() const override { return total_; }
  std::uint64_t getPosition() const override { return total_; }
  bool ranOut() const { return ran_out_; }

 private:
  mrpt::io::CStream& source_;
  std::uint64_t total_ = 0;
  bool ran_out_ = false;
};

// Bytes of a damaged file may end up in a text: Python wants it readable.
std::string printable(std::string text) {
  for (char& letter : text)
    if (letter < ' ' || letter > '~') letter = '?';
  return text;
}

// The sentence of an MRPT exception without the source lines and the backtrace around it.
std::string sentence(const std::string& what) {
  std::size_t begin = what.find("Message:");
  begin = begin == std::string::npos ? 0 : begin + 8;
  begin = what.find_first_not_of(" \t\n", begin);
  if (begin == std::string::npos) return "unknown error";
  std::size_t end = what.find('\n', begin);
  end = end == std::string::npos ? what.size() : end;
  while (end > begin && (what[end - 1] == ' ' || what[end - 1] == '\r' || what[end - 1] == '.')) --end;
  return printable(what.substr(begin, end - begin));
}

void open(mrpt::io::CFileGZInputStream& file, const std::string& path) {
  bool opened = false;
  try {
    opened = file.open(path);
  } catch (const std::exception&) {
    opened = false;
  }
  if (!opened) throw std::invalid_argument("cannot be opened");
}

// MRPT counts 100 ns since 1601; 0 is "no time".
std::int64_t unix_nanoseconds(const mrpt::system::TTimeStamp& stamp) {
  constexpr std::int64_t kTicksTo1970 = 116444736000000000LL;
  const std::int64_t ticks = static_cast<std::int64_t>(stamp.time_since_epoch().count());
  return stamp == INVALID_TIMESTAMP || ticks < kTicksTo1970 ? -1 : (ticks - kTicksTo1970) * 100;
}

void add_scan(Rawlog& log, const mrpt::obs::CObservation2DRangeScan& scan) {
  const std::size_t beams = scan.getScanSize();
  log.stamps_ns.push_back(unix_nanoseconds(scan.timestamp));
  log.beams.push_back(static_cast<std::int64_t>(beams));
  for (std::size_t i = 0; i < beams; ++i) {
    log.ranges_m.push_back(scan.getScanRange(i));
    log.valid.push_back(scan.getScanRangeValidity(i) ? 1 : 0);
  }
  // The beams span the aperture from edge to edge, the first one on the right if rightToLeft.
  const double sign = scan.rightToLeft ? 1.0 : -1.0;
  const double aperture = static_cast<double>(scan.aperture);
  log.first_angle_rad.push_back(-sign * aperture / 2.0);
  log.angle_step_rad.push_back(beams > 1 ? sign * aperture / static_cast<double>(beams - 1) : 0.0);
  log.range_max_m.push_back(static_cast<double>(scan.maxRange));
  const mrpt::poses::CPose3D& pose = scan.sensorPose;
  log.sensor_pose.push_back({pose.x(), pose.y(), pose.z(), pose.yaw(), pose.pitch(), pose.roll()});
  log.labels.push_back(printable(scan.sensorLabel));
  log.odometry_index.push_back(static_cast<std::int64_t>(log.odometry.size()) - 1);
}

void add_odometry(Rawlog& log, std::int64_t stamp_ns, const mrpt::poses::CPose2D& pose) {
  log.odometry_stamps_ns.push_back(stamp_ns);
  log.odometry.push_back({pose.x(), pose.y(), pose.phi()});
}

// What the robot moved between two sensory frames; false if the collection holds no movement.
bool movement(const mrpt::obs::CActionCollection& actions, mrpt::poses::CPose2D& increment) {
  if (const auto planar = actions.getBestMovementEstimation()) {
    // The mean of a sampled motion model is itself a random number: take the reading it was drawn from.
    const bool odometry = planar->estimationMethod == mrpt::obs::CActionRobotMovement2D::emOdometry;
    if (odometry)
      increment = planar->rawOdometryIncrementReading;
    else
      increment = planar->poseChange->getMeanVal();
    return true;
  }
  if (const auto spatial = actions.getActionByClass<mrpt::obs::CActionRobotMovement3D>()) {
    increment = mrpt::poses::CPose2D(spatial->poseChange.mean);
    return true;
  }
  return false;
}

void add_observation(Rawlog& log, const mrpt::obs::CObservation& observation) {
  ++log.objects[observation.GetRuntimeClass()->className];
  if (const auto* scan = dynamic_cast<const mrpt::obs::CObservation2DRangeScan*>(&observation))
    add_scan(log, *scan);
  else if (const auto* odometry = dynamic_cast<const mrpt::obs::CObservationOdometry*>(&observation))
    add_odometry(log, unix_nanoseconds(odometry->timestamp), odometry->odometry);
}

}  // namespace

Rawlog read_rawlog(const std::string& path) {
  mrpt::io::CFileGZInputStream file;
  open(file, path);
  CountingStream stream(file);
  auto archive = mrpt::serialization::archiveFrom(stream);

  Rawlog log;
  mrpt::poses::CPose2D odometry;  // accumulated over the actions
  for (std::int64_t number = 1;; ++number) {
    const std::uint64_t start = stream.getPosition();
    CSerializable::Ptr object;
    try {
      object = archive.ReadObject();
    } catch (const std::exception& error) {
      if (stream.getPosition() == start) break;  // not a byte after the last object: the end
      log.broken = stream.ranOut()
                       ? "ends within object " + std::to_string(number)
                       : "has object " + std::to_string(number) + " damaged (" + sentence(error.what()) + ")";
      break;
    }
    if (!object) continue;
    if (const auto actions = std::dynamic_pointer_cast<mrpt::obs::CActionCollection>(object)) {
      ++log.objects["CActionCollection"];
      mrpt::poses::CPose2D increment;
      if (movement(*actions, increment)) {
        log.paired = true;
        odometry = odometry + increment;
        add_odometry(log, -1, odometry);
      }
    } else if (const auto frame = std::dynamic_pointer_cast<mrpt::obs::CSensoryFrame>(object)) {
      ++log.objects["CSensoryFrame"];
      for (const auto& observation : *frame)
        if (observation) add_observation(log, *observation);
    } else if (const auto observation = std::dynamic_pointer_cast<mrpt::obs::CObservation>(object)) {
      add_observation(log, *observation);
    } else {
      ++log.objects[object->GetRuntimeClass()->className];
    }
  }
  if (log.objects.empty()) {
    if (log.broken.empty()) throw std::invalid_argument("is empty or cut short");
    throw std::invalid_argument("is no rawlog: it " + log.broken);
  }
  return log;
}

GridFile read_grid_map(const std::string& path) {
  mrpt::io::CFileGZInputStream file;
  open(file, path);
  CountingStream stream(file);
  auto archive = mrpt::serialization::archiveFrom(stream);
  CSerializable::Ptr object;
  try {
    object = archive.ReadObject();
  } catch (const std::exception& error) {
    if (stream.getPosition() == 0) throw std::invalid_argument("is empty or cut short");
    throw std::invalid_argument(stream.ranOut() ? "is no MRPT grid map, or cut short"
                                                : "is no MRPT grid map (" + sentence(error.what()) + ")");
  }
  const auto grid = std::dynamic_pointer_cast<mrpt::maps::COccupancyGridMap2D>(object);
  if (!grid) {
    const std::string name = object ? object->GetRuntimeClass()->className : "nothing";
    throw std::invalid_argument("holds " + name + ", a grid map is COccupancyGridMap2D");
  }

  GridFile out;
  out.rows = static_cast<std::int64_t>(grid->getSizeY());
  out.columns = static_cast<std::int64_t>(grid->getSizeX());
  out.resolution_m = static_cast<double>(grid->getResolution());
  out.x_min_m = static_cast<double>(grid->getXMin());
  out.y_min_m = static_cast<double>(grid->getYMin());
  out.occupancy.reserve(static_cast<std::size_t>(out.rows * out.columns));
  for (int y = 0; y < static_cast<int>(out.rows); ++y) {
    for (int x = 0; x < static_cast<int>(out.columns); ++x) {
      const double free = static_cast<double>(grid->getCell(x, y));
      // A cell nothing was ever said about has log odds 0, which is exactly one half.
      const bool unknown = std::abs(free - 0.5) < 1e-6;
      out.occupancy.push_back(unknown ? std::int8_t{-1} : static_cast<std::int8_t>(std::lround(100.0 * (1.0 - free))));
    }
  }
  return out;
}

}  // namespace glass_nav
