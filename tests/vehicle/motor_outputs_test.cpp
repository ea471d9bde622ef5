#include "pointflight/vehicle/motor_outputs.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "pointflight/geometry/frames.hpp"

namespace pointflight {
namespace {

TEST(MotorOutputs, QuadrotorsAreNumberedAsFirmwaresDo) {
  for (const char* name : {"quad_330", "quad_250", "marsim_quad"}) {
    const VehicleSettings vehicle = load_vehicle(name);
    const MotorOutputs motors(vehicle);
    const auto at = [&](std::size_t output) {
      return vehicle.rotors[motors.rotors()[output]].position;
    };
    EXPECT_TRUE(at(0).x() > 0 && at(0).y() < 0) << name;  // front right
    EXPECT_TRUE(at(1).x() < 0 && at(1).y() > 0) << name;  // rear left
    EXPECT_TRUE(at(2).x() > 0 && at(2).y() > 0) << name;  // front left
    EXPECT_TRUE(at(3).x() < 0 && at(3).y() < 0) << name;  // rear right
  }
  const MotorOutputs hexa(load_vehicle("hexa_550"));
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(hexa.rotors()[i], i);
}

TEST(MotorOutputs, SpeedsGoStraightFromLeastToGreatest) {
  const VehicleSettings vehicle = load_vehicle("quad_330");
  const MotorOutputs motors(vehicle);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::array<float, 4> outputs = {0.5f, 2.0f, nan, -1.0f};
  const std::vector<double> speeds = motors.speeds(outputs, true);
  const RotorModel& rotor = vehicle.rotor;
  EXPECT_NEAR(speeds[motors.rotors()[0]], 0.5 * (rotor.speed_min + rotor.speed_max), 1e-9);
  EXPECT_EQ(speeds[motors.rotors()[1]], rotor.speed_max);
  EXPECT_EQ(speeds[motors.rotors()[2]], rotor.speed_min);
  EXPECT_EQ(speeds[motors.rotors()[3]], rotor.speed_min);
  for (const double speed : motors.speeds(outputs, false)) EXPECT_EQ(speed, 0.0);
  EXPECT_NEAR(
      motors.output_of(rotor.speed_min + motors.hover() * (rotor.speed_max - rotor.speed_min)),
      motors.hover(),
      1e-12);
  const double lift =
      4.0 * rotor.thrust_coefficient * vehicle.hover_speed() * vehicle.hover_speed();
  EXPECT_NEAR(lift, vehicle.mass * 9.80665, 0.01);
}

TEST(MotorOutputs, TheThrustCurveIsPx4s) {
  const VehicleSettings vehicle = load_vehicle("quad_330");
  const MotorOutputs motors(vehicle);
  const double f = motors.square_share();
  const double a = vehicle.rotor.speed_min / vehicle.rotor.speed_max;
  for (double u = 0.0; u <= 1.0; u += 0.1) {
    const double speed = a + (1.0 - a) * u;
    EXPECT_NEAR(f * u * u + (1.0 - f) * u, speed * speed, 0.02) << u;
  }
}

TEST(SitlFrames, AreThoseOfFirmwares) {
  // level, heading north: body axes are the world's
  const Quaterniond north(Eigen::AngleAxisd(1.5707963267948966, Vector3d::UnitZ()));
  EXPECT_NEAR(q_ned_frd(north).angularDistance(Quaterniond::Identity()), 0.0, 1e-7);
  // level, heading east: a quarter to the right of north
  const Quaterniond right(Eigen::AngleAxisd(1.5707963267948966, Vector3d::UnitZ()));
  EXPECT_NEAR(q_ned_frd(Quaterniond::Identity()).angularDistance(right), 0.0, 1e-7);
  const Quaterniond any = Quaterniond(0.3, -0.5, 0.7, 0.2).normalized();
  for (const Vector3d& v : {Vector3d(1, 2, 3), Vector3d(-3, 0.5, 1)}) {
    // the same vector by either way
    EXPECT_LT((q_ned_frd(any) * frd_from_flu(v) - ned_from_enu(any * v)).norm(), 1e-12);
  }
  EXPECT_NEAR(q_ned_frd(q_ned_frd(any)).angularDistance(any), 0.0, 1e-7);
}

}  // namespace
}  // namespace pointflight
