#include "pointflight/vehicle/vehicle_shape.hpp"

#include <gtest/gtest.h>

#include "pointflight/vehicle/airframe.hpp"

namespace pointflight {
namespace {

TEST(VehicleShape, WhatIsSeenOfAShippedVehicleLiesWithinItsHull) {
  for (const char* name :
       {"quad_250", "quad_330", "quad_450", "hexa_550", "octo_1045", "lee2010", "marsim_quad"}) {
    const VehicleSettings settings = load_vehicle(name);
    const Assembly assembly = assembly_of(settings);
    const std::size_t rotors = settings.rotors.size();
    EXPECT_EQ(assembly.parts.size(), 1 + 2 * rotors) << name;
    EXPECT_EQ(assembly.propellers.size(), rotors) << name;
    for (int ms = 0; ms < 10; ++ms) {
      const SimTime time{from_seconds(1e-3 * ms)};
      for (const Vector3d& p : surface_points(assembly, 0.02, time)) {
        ASSERT_LE(signed_distance(settings.hull(), p), 1e-3) << name << " " << p.transpose();
      }
    }
    for (std::size_t i = 0; i < rotors; ++i) {
      const Propeller& p = assembly.propellers[i];
      EXPECT_EQ(p.center, settings.rotors[i].position);
      // it turns against the torque that the air's reaction gives the body
      EXPECT_LT(p.speed * settings.rotors[i].yaw_sign, 0.0);
      for (std::size_t k = 0; k < i; ++k) {
        const double apart = (p.center - assembly.propellers[k].center).norm();
        EXPECT_GT(apart, p.radius + assembly.propellers[k].radius) << name << ": propellers touch";
      }
    }
  }
}

TEST(VehicleShape, AFileSaysWhatDoesNotFollow) {
  VehicleSettings settings = load_vehicle("quad_330");
  settings.airframe.body_size = {0.3, 0.1, 0.05};
  settings.airframe.body_center = {0.02, 0, -0.03};
  settings.airframe.propeller_radius = 0.05;
  settings.vibration.blades = 3;
  settings.airframe.blade_chord = 0.02;
  settings.airframe.arm_radius = 0.012;
  const Assembly assembly = assembly_of(settings);
  EXPECT_EQ(std::get<Box>(assembly.parts[0].solid).half, Vector3d(0.15, 0.05, 0.025));
  EXPECT_EQ(assembly.parts[0].T_assembly_part.translation, Vector3d(0.02, 0, -0.03));
  EXPECT_EQ(std::get<Capsule>(assembly.parts[1].solid).radius, 0.012);
  EXPECT_EQ(assembly.propellers[0].radius, 0.05);
  EXPECT_EQ(assembly.propellers[0].blades, 3);
  EXPECT_EQ(assembly.propellers[0].chord, 0.02);
  // nobody knows how large its propellers are
  settings.airframe.propeller_radius = 0.0;
  settings.rotor.radius = 0.0;
  EXPECT_TRUE(assembly_of(settings).propellers.empty());
}

}  // namespace
}  // namespace pointflight
