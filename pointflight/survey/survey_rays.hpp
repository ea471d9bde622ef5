// A survey as rays: each says that the space up to its return is free.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "pointflight/geometry/motion.hpp"
#include "pointflight/geometry/types.hpp"
#include "pointflight/io/cloud_reader.hpp"

namespace pointflight {

/// One shot of a survey, where the surveyor believes that it went.
struct SurveyRay {
  Vector3d origin_world = Vector3d::Zero();      ///< Of the sensor at that instant, m.
  Vector3f direction_world = Vector3f::UnitX();  ///< Unit vector.
  float range = 0.0f;      ///< Of the return; without one, up to where nothing was for sure, m.
  float intensity = 0.0f;  ///< In the scans' own scale; 0 without.
  bool is_return = true;   ///< False: nothing came back.

  /// Where the return lies.
  [[nodiscard]] Vector3d point_world() const {
    return origin_world + static_cast<double>(range) * direction_world.cast<double>();
  }
};

/// Where the sensor was: `poses` by ascending time (one at least), between which it moves evenly;
/// after the last one it goes on as before.
Pose pose_on(std::span<const TimedPose> poses, SimTime time);

/// How far apart in time the two poses are that `pose_on` uses, s; 0 of a single pose.
double poses_apart(std::span<const TimedPose> poses, SimTime time);

/// The ray from a sensor to a point in its frame, m; the point must not be the sensor itself.
SurveyRay survey_ray(const Pose& T_world_sensor, const Vector3d& point_sensor, bool is_return);

/// Reads a survey front to back in batches: it is never in memory as a whole.
class SurveyReader {
 public:
  virtual ~SurveyReader() = default;
  /// Replaces `batch` with the next rays (at most about 100,000). False when there are none left.
  /// Throws InputError.
  virtual bool read(std::vector<SurveyRay>& batch) = 0;
  /// Which scan the last batch is of, by its number in the source.
  [[nodiscard]] virtual std::size_t scan() const { return 0; }
  /// True if the returns carry an intensity.
  [[nodiscard]] virtual bool has_intensity() const { return false; }
  /// Share of the survey that was read, 0 to 1.
  [[nodiscard]] virtual double share_read() const = 0;
};

/// Opens a survey at its beginning, as often as it takes.
using SurveyOpener = std::function<std::unique_ptr<SurveyReader>()>;

/// A survey as scans that can be read as often as wanted.
class SurveySource {
 public:
  virtual ~SurveySource() = default;
  /// Scans in it.
  [[nodiscard]] virtual std::size_t scan_count() const = 0;
  /// What people call a scan: its file's name, or its number.
  [[nodiscard]] virtual std::string name(std::size_t scan) const = 0;
  /// T_world_sensor at a scan's stamp.
  [[nodiscard]] virtual Pose pose(std::size_t scan) const = 0;
  /// Reads the scans that `chosen` accepts by their number, all without it. The survey must outlive
  /// the reader. Throws InputError.
  [[nodiscard]] virtual std::unique_ptr<SurveyReader> open(
      const std::function<bool(std::size_t scan)>& chosen = {}) const = 0;
};

/// The returns of a survey as a cloud in the world.
std::unique_ptr<CloudReader> cloud_of(std::unique_ptr<SurveyReader> survey);

}  // namespace pointflight
