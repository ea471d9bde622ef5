#pragma once

#include <algorithm>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "pointflight/core/time.hpp"
#include "pointflight/lidar/scan.hpp"
#include "pointflight/ros/common/cloud_grid.hpp"
#include "pointflight/ros/common/messages.hpp"

namespace pointflight {

/// How the points of a PointCloud2 lie in memory: what a sensor's ROS driver sends.
///
/// To add one: an entry in the table in point_layout.cpp, a test of its fields and values.
struct PointLayout {
  /// What a field holds.
  enum class Source {
    kX,
    kY,
    kZ,
    kIntensity,
    kRing,
    kTag,            ///< Livox: 0x10, a single return of good confidence.
    kSecondsAfter,   ///< After the cloud's stamp.
    kNanosAfter,     ///< The same.
    kAbsoluteNanos,  ///< Since the epoch.
    kAbsoluteSeconds,
    kRangeMillimetres,
    kUnknown,  ///< 1: came through space no survey saw; wants a LiDAR with `mark_unknown`.
    kZero,
  };
  /// One value of a point.
  struct Field {
    const char* name;      ///< "x", "intensity", "t", ...
    std::uint32_t offset;  ///< Bytes from the point's first.
    std::uint8_t type;  ///< `msg::PointField::FLOAT32`, ...  Values are rounded and clamped to it.
    Source source;      ///< What it holds.
  };
  const char* name;               ///< In profiles.
  const char* help;               ///< Whose it is: for error messages and docs.
  std::uint32_t step;             ///< Bytes per point.
  std::span<const Field> fields;  ///< By rising offset; bytes between them are 0.
  bool timed;                     ///< Points have times: stamped with the first one.

  /// True if one of its fields holds that.
  [[nodiscard]] bool has(Source source) const {
    return std::any_of(
        fields.begin(), fields.end(), [&](const Field& f) { return f.source == source; });
  }
};

/// In profiles: not a PointCloud2 but Livox' own message.
inline constexpr const char* kLivoxCustom = "livox_custom";

/// Layout of a name. Throws InputError with the names there are.
const PointLayout& point_layout(std::string_view name);

/// All of them.
std::span<const PointLayout> point_layouts();

/// The instant that a cloud of this scan is stamped with: that of its first point where points have
/// times (the scan's start without points), else `Scan::middle`.
SimTime cloud_time(const Scan& scan, bool timed);

/// What returns of a map without intensities are given, since programs drop points of none: a grey
/// wall's 30 % in Livox' scale (0 to 150 is diffuse reflection of 0 to 100 %) is 45.
inline constexpr float kPlainIntensity = 45.0f;

/// The scan as a cloud: height 1, no NaN, in firing order. Stamps count from `epoch`. Positions are
/// the sensor's at each point's own time, unless `positions` (one for each point) gives others.
/// `plain` is the intensity of returns that have none. With a `grid` it is organised instead: the
/// first return of each beam in its cell; cells without one are NaN at about the time of their
/// firing.
msg::PointCloud2 cloud_of(const Scan& scan,
                          const PointLayout& layout,
                          const std::string& frame,
                          Duration epoch,
                          std::span<const Vector3f> positions = {},
                          float plain = 0.0f,
                          const CloudGrid* grid = nullptr);

/// The same as Livox' CustomMsg: tag 0x10, line = ring.
msg::CustomMsg custom_cloud_of(const Scan& scan,
                               const std::string& frame,
                               Duration epoch,
                               float plain = 0.0f);

/// Bare points as a cloud of a layout without times.
msg::PointCloud2 cloud_of_points(std::span<const Vector3f> points,
                                 std::span<const float> intensities,
                                 const PointLayout& layout);

/// A time of the run as ROS has it.
msg::Time stamp_of(SimTime time, Duration epoch);

}  // namespace pointflight
