#include "pointflight/sim/faults.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>

namespace pointflight {
namespace {

constexpr Named<FaultKind> kFaultKinds[] = {{FaultKind::kRotor, "rotor"},
                                            {FaultKind::kLidar, "lidar"},
                                            {FaultKind::kImu, "imu"},
                                            {FaultKind::kOdometryDelay, "odometry_delay"},
                                            {FaultKind::kScanDrop, "scan_drop"}};
constexpr Named<ImuAxis> kAxes[] = {{ImuAxis::kGyroX, "gyro_x"},
                                    {ImuAxis::kGyroY, "gyro_y"},
                                    {ImuAxis::kGyroZ, "gyro_z"},
                                    {ImuAxis::kAccelX, "accel_x"},
                                    {ImuAxis::kAccelY, "accel_y"},
                                    {ImuAxis::kAccelZ, "accel_z"}};

bool is_on(const FaultSettings& fault, SimTime time) {
  const Duration t = time.time_since_epoch();
  return t >= from_seconds(fault.from) && (fault.until <= 0.0 || t < from_seconds(fault.until));
}

bool is_of(const FaultSettings& fault, FaultKind kind, std::size_t index) {
  return fault.kind == kind && fault.index == static_cast<std::int64_t>(index);
}

}  // namespace

void describe(SettingsVisitor& v, FaultSettings& s) {
  v.choice({"kind",
            "",
            "a rotor that loses speed, a dead lidar, a stuck IMU axis, late odometry, lost scans"},
           s.kind,
           kFaultKinds);
  v.value({"from", "s", "when it starts", 0, 1e6}, s.from);
  v.value({"until", "s", "when it ends; 0: never", 0, 1e6}, s.until);
  const auto is = [&](FaultKind kind) { return s.kind == kind; };
  v.only_if(is(FaultKind::kRotor) || is(FaultKind::kLidar) || is(FaultKind::kScanDrop),
            "kind: rotor, lidar, scan_drop",
            [&](SettingsVisitor& w) {
              w.value({"index", "", "of the rotor or lidar", 0, 255}, s.index);
            });
  v.only_if(is(FaultKind::kImu), "kind: imu", [&](SettingsVisitor& w) {
    w.choice({"axis", "", "of the IMU that repeats its last value"}, s.axis, kAxes);
  });
  v.only_if(is(FaultKind::kRotor) || is(FaultKind::kOdometryDelay) || is(FaultKind::kScanDrop),
            "kind: rotor, odometry_delay, scan_drop",
            [&](SettingsVisitor& w) {
              w.value(
                  {"value",
                   "",
                   "rotor: share of speed left; odometry_delay: seconds; scan_drop: share of scans "
                   "lost",
                   0,
                   60},
                  s.value);
            });
}

void check(const FaultSettings& s,
           const std::function<void(const char* key, const std::string& what)>& fail) {
  if (s.until > 0.0 && s.until <= s.from) {
    fail("until", fmt::format("{} s is not after {} s (from); 0 means for good", s.until, s.from));
  }
  const bool is_share = s.kind == FaultKind::kRotor || s.kind == FaultKind::kScanDrop;
  if (is_share && s.value > 1.0) {
    fail("value", fmt::format("{} of kind {}; a share, from 0 to 1", s.value, to_string(s.kind)));
  }
}

std::string_view to_string(FaultKind kind) {
  return name_in(kFaultKinds, kind);
}

double Faults::rotor_share(std::size_t rotor, SimTime time) const {
  double share = 1.0;
  for (const FaultSettings& fault : settings_) {
    if (is_of(fault, FaultKind::kRotor, rotor) && is_on(fault, time))
      share = std::min(share, fault.value);
  }
  return share;
}

bool Faults::is_dead(std::size_t lidar, SimTime time) const {
  return std::any_of(settings_.begin(), settings_.end(), [&](const FaultSettings& fault) {
    return is_of(fault, FaultKind::kLidar, lidar) && is_on(fault, time);
  });
}

bool Faults::is_stuck(std::size_t axis, SimTime time) const {
  assert(axis < std::size(kAxes));
  return std::any_of(settings_.begin(), settings_.end(), [&](const FaultSettings& fault) {
    return fault.kind == FaultKind::kImu && fault.axis == static_cast<ImuAxis>(axis) &&
           is_on(fault, time);
  });
}

Duration Faults::odometry_delay(SimTime time) const {
  Duration delay{0};
  for (const FaultSettings& fault : settings_) {
    if (fault.kind == FaultKind::kOdometryDelay && is_on(fault, time)) {
      delay = std::max(delay, from_seconds(fault.value));
    }
  }
  return delay;
}

double Faults::dropped_share(std::size_t lidar, SimTime time) const {
  double share = 0.0;
  for (const FaultSettings& fault : settings_) {
    if (is_of(fault, FaultKind::kScanDrop, lidar) && is_on(fault, time)) {
      share = std::max(share, fault.value);
    }
  }
  return share;
}

}  // namespace pointflight
