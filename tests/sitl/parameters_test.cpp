#include <gtest/gtest.h>

#include <map>

#include "pointflight/core/input_error.hpp"
#include "pointflight/sitl/ardupilot_parameters.hpp"
#include "pointflight/sitl/px4_airframe.hpp"
#include "pointflight/sitl/px4_parameters.hpp"
#include "pointflight/vehicle/motor_outputs.hpp"
#include "pointflight/vehicle/multirotor.hpp"

namespace pointflight {
namespace {

TEST(ArduPilotParameters, GainsTurnTheVehicleAsItsLoopsAreDesigned) {
  // the model itself says what a unit of roll output does: half of the greatest thrust more on the
  // left, less on the right
  const VehicleSettings vehicle = load_vehicle("x500");
  const auto list = ardupilot_parameters(vehicle);
  const std::map<std::string, double> values(list.begin(), list.end());
  const Multirotor multirotor(vehicle);
  const RotorModel& rotor = vehicle.rotor;
  const double middle = 0.4 * rotor.speed_max * rotor.speed_max;
  const double change = 1e-3 * 0.5 * rotor.speed_max * rotor.speed_max;
  const auto alpha = [&](int axis) {
    VehicleState state = multirotor.hover_at({0, 0, 100}, 0.0);
    for (std::size_t i = 0; i < 4; ++i) {
      const RotorPlacement& r = vehicle.rotors[i];
      const double sign = axis == 0   ? (r.position.y() > 0.0 ? 1.0 : -1.0)
                          : axis == 1 ? (r.position.x() > 0.0 ? -1.0 : 1.0)
                                      : r.yaw_sign;
      state.rotors[i] = {std::sqrt(middle + sign * change), 0.0};
    }
    return multirotor.acceleration(state).alpha_body[axis] / 1e-3;
  };
  const LoopDesign& tilt = vehicle.controller.roll_pitch;
  EXPECT_NEAR(
      values.at("ATC_RAT_RLL_P") * alpha(0), 2.0 * tilt.damping * tilt.natural_frequency, 1e-3);
  EXPECT_NEAR(
      values.at("ATC_RAT_PIT_P") * alpha(1), 2.0 * tilt.damping * tilt.natural_frequency, 1e-3);
  const LoopDesign& yaw = vehicle.controller.yaw;
  EXPECT_NEAR(
      values.at("ATC_RAT_YAW_P") * alpha(2), 2.0 * yaw.damping * yaw.natural_frequency, 1e-3);
  EXPECT_EQ(values.at("SERVO3_FUNCTION"), 35);
  EXPECT_NEAR(values.at("MOT_THST_HOVER"), 1.0 / vehicle.thrust_to_weight(), 0.06);
  EXPECT_THROW(ardupilot_parameters(load_vehicle("hexa_550")), InputError);
}

TEST(Px4Airframe, RotorsComeBackFromTheParametersOfAVehicle) {
  for (const char* name : {"x500", "iris", "hexa_550"}) {
    const VehicleSettings vehicle = load_vehicle(name);
    const VehicleSettings back = vehicle_from_px4_airframe(
        px4_parameter_file(vehicle, false), "x.params", load_vehicle("quad_330"));
    const MotorOutputs motors(vehicle);
    ASSERT_EQ(back.rotors.size(), vehicle.rotors.size());
    for (std::size_t i = 0; i < back.rotors.size(); ++i) {
      const RotorPlacement& rotor = vehicle.rotors[motors.rotors()[i]];
      EXPECT_LT((back.rotors[i].position - rotor.position).norm(), 1e-6) << name;
      EXPECT_EQ(back.rotors[i].yaw_sign, rotor.yaw_sign) << name;
    }
    EXPECT_NEAR(back.rotor.torque_coefficient / back.rotor.thrust_coefficient,
                vehicle.rotor.torque_coefficient / vehicle.rotor.thrust_coefficient,
                1e-8);
  }
}

TEST(Px4Airframe, StartScriptsAreRead) {
  std::string text =
      "#!/bin/sh\n# @name Mine\n. ${R}etc/init.d/rc.mc_defaults\n"
      "param set-default CA_ROTOR_COUNT 4  # of them\n";
  const char* corners[] = {"0.1 0.2", "-0.1 -0.2", "0.1 -0.2", "-0.1 0.2"};
  for (int i = 0; i < 4; ++i) {
    const std::string corner = corners[i];
    const std::string rotor = "param set-default CA_ROTOR" + std::to_string(i);
    text += rotor + "_PX " + corner.substr(0, corner.find(' ')) + "\n" + rotor + "_PY " +
            corner.substr(corner.find(' ') + 1) + "\n";
    if (i >= 2) text += rotor + "_KM -0.05\n";
  }
  const VehicleSettings like = load_vehicle("x500");
  const VehicleSettings vehicle = vehicle_from_px4_airframe(text, "4321_mine", like);
  EXPECT_EQ(vehicle.rotors[0].position, Vector3d(0.1, -0.2, 0.0));
  EXPECT_EQ(vehicle.rotors[0].yaw_sign, -1.0);
  EXPECT_EQ(vehicle.rotors[3].yaw_sign, 1.0);
  EXPECT_EQ(vehicle.mass, like.mass);
  const auto error = [&](const std::string& more) -> std::string {
    try {
      vehicle_from_px4_airframe(text + more, "4321_mine", like);
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(error("param set-default CA_ROTOR1_PX abc\n"),
            "4321_mine:15: CA_ROTOR1_PX: 'abc' is not a number");
  EXPECT_NE(error("param set CA_ROTOR2_AX 0.3\n").find("push straight up"), std::string::npos);
  EXPECT_NE(error("param set CA_ROTOR_COUNT 5\n").find("CA_ROTOR4_P"), std::string::npos);
  EXPECT_NE(error("param set CA_ROTOR_COUNT 1e9\n").find("4 to 32"), std::string::npos);
}

}  // namespace
}  // namespace pointflight
