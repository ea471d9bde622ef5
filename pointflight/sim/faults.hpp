#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "pointflight/core/settings.hpp"
#include "pointflight/core/time.hpp"

namespace pointflight {

/// What can go wrong.
enum class FaultKind {
  kRotor,          ///< It has a share of its speed left.
  kLidar,          ///< It gives nothing.
  kImu,            ///< An axis repeats its last value.
  kOdometryDelay,  ///< Odometry arrives late.
  kScanDrop,       ///< A share of the scans is lost.
};

/// An axis of an IMU, in this order.
enum class ImuAxis {
  kGyroX,
  kGyroY,
  kGyroZ,
  kAccelX,
  kAccelY,
  kAccelZ,
};

/// One thing that goes wrong on a vehicle for a time.
struct FaultSettings {
  FaultKind kind = FaultKind::kRotor;  ///< What goes wrong.
  double from = 0.0;                   ///< s
  double until = 0.0;                  ///< s; 0: for good
  std::int64_t index = 0;              ///< Rotor or lidar.
  ImuAxis axis = ImuAxis::kGyroX;      ///< Of an IMU that is stuck.
  /// rotor: share of its commanded speed that is left; odometry_delay: s; scan_drop: share lost.
  double value = 0.0;
};

/// As files have it: "rotor", ...
std::string_view to_string(FaultKind kind);

/// The keys of one entry of `faults`.
void describe(SettingsVisitor& visitor, FaultSettings& settings);

/// Calls `fail` with the key and what is wrong if values make no sense together.
void check(const FaultSettings& settings,
           const std::function<void(const char* key, const std::string& what)>& fail);

/// The faults of one vehicle as functions of time.
class Faults {
 public:
  Faults() = default;
  /// Of one vehicle, each passed by `check`. Of rotor faults that act at once the smallest share
  /// counts.
  explicit Faults(std::vector<FaultSettings> settings) : settings_(std::move(settings)) {}

  /// False for most vehicles: nothing else has to be asked then.
  [[nodiscard]] bool any() const { return !settings_.empty(); }

  /// Share of a rotor's commanded speed that is left, 0 to 1.
  [[nodiscard]] double rotor_share(std::size_t rotor, SimTime time) const;
  /// True while a lidar gives nothing.
  [[nodiscard]] bool is_dead(std::size_t lidar, SimTime time) const;
  /// True while an IMU axis (0..2 gyro, 3..5 accelerometer) repeats its last value.
  [[nodiscard]] bool is_stuck(std::size_t axis, SimTime time) const;
  /// How much later odometry arrives.
  [[nodiscard]] Duration odometry_delay(SimTime time) const;
  /// Share of a lidar's scans that is lost.
  [[nodiscard]] double dropped_share(std::size_t lidar, SimTime time) const;

 private:
  std::vector<FaultSettings> settings_;
};

}  // namespace pointflight
