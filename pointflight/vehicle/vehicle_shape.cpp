#include "pointflight/vehicle/vehicle_shape.hpp"

#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"

namespace pointflight {
namespace {

// shares of usual proportions, for what a file leaves out
constexpr double kBodyWidth = 0.7;     // of the arms' mean length
constexpr double kBodyHeight = 0.35;   // of the same
constexpr double kArmRadius = 0.04;    // of the same
constexpr double kChord = 0.18;        // of the propeller's radius
constexpr double kHub = 0.1;           // of the same
constexpr double kMotorRadius = 0.15;  // of the same
constexpr double kMotorHeight = 0.2;   // of the same
constexpr double kBareMotor = 0.1;     // of the arm's length, if no propeller is known

/// Of rotors in the order of the file: no two alike.
constexpr double kPhaseStep = 2.399963;  // rad

/// Along a segment: a capsule's own axis is z.
Pose along(const Vector3d& from, const Vector3d& to) {
  return {Quaterniond::FromTwoVectors(Vector3d::UnitZ(), to - from), 0.5 * (from + to)};
}

double or_else(double value, double otherwise) {
  return value > 0.0 ? value : otherwise;
}

}  // namespace

Assembly assembly_of(const VehicleSettings& settings) {
  const AirframeSettings& a = settings.airframe;
  double length = 0.0;
  for (const RotorPlacement& rotor : settings.rotors) {
    length += rotor.position.head<2>().norm() / static_cast<double>(settings.rotors.size());
  }
  const double propeller = or_else(a.propeller_radius, settings.rotor.radius);
  const double motor_radius = propeller > 0.0 ? kMotorRadius * propeller : kBareMotor * length;
  const double motor_height = propeller > 0.0 ? kMotorHeight * propeller : kBareMotor * length;
  Assembly assembly;
  const Vector3d body = a.body_size.minCoeff() > 0.0
                            ? a.body_size
                            : Vector3d(length * Vector3d(kBodyWidth, kBodyWidth, kBodyHeight));
  if (body.minCoeff() > 0.0) {
    assembly.parts.push_back({Box{0.5 * body}, {Quaterniond::Identity(), a.body_center}});
  }
  const double arm_radius = or_else(a.arm_radius, kArmRadius * length);
  for (std::size_t i = 0; i < settings.rotors.size(); ++i) {
    const Vector3d top = settings.rotors[i].position;
    const Vector3d foot = top - Vector3d(0.0, 0.0, motor_height);
    const Vector3d root(0.0, 0.0, foot.z());
    const Vector3d middle = 0.5 * (top + foot);
    if ((foot - root).norm() > 0.0) {
      assembly.parts.push_back(
          {Capsule{arm_radius, 0.5 * (foot - root).norm()}, along(root, foot)});
    }
    if (motor_radius > 0.0) {
      assembly.parts.push_back(
          {Cylinder{motor_radius, 0.5 * motor_height}, {Quaterniond::Identity(), middle}});
    }
    if (propeller <= 0.0) continue;
    Propeller p;
    p.center = top;
    p.radius = propeller;
    p.hub_radius = kHub * propeller;
    p.chord = or_else(a.blade_chord, kChord * propeller);
    p.pitch = a.blade_pitch_deg * kDegree;
    p.blades = static_cast<int>(settings.vibration.blades);
    // the air's reaction torque is against the turning
    p.speed = settings.rotors[i].yaw_sign > 0.0 ? -settings.hover_speed() : settings.hover_speed();
    p.phase = kPhaseStep * static_cast<double>(i);
    assembly.propellers.push_back(p);
  }
  return assembly;
}

}  // namespace pointflight
