#include "pointflight/vehicle/airframe.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/resources.hpp"

namespace pointflight {
namespace {

constexpr Named<HullShape> kShapes[] = {
    {HullShape::kSphere, "sphere"}, {HullShape::kBox, "box"}, {HullShape::kCapsule, "capsule"}};
constexpr Named<CommandLevel> kLevels[] = {{CommandLevel::kRotorSpeeds, "rotor_speeds"},
                                           {CommandLevel::kBodyRates, "body_rates"},
                                           {CommandLevel::kAttitude, "attitude"},
                                           {CommandLevel::kAcceleration, "acceleration"},
                                           {CommandLevel::kVelocity, "velocity"},
                                           {CommandLevel::kPosition, "position"}};

Key required(Key key) {
  key.required = true;
  return key;
}

void describe_rotor(SettingsVisitor& v, RotorModel& r) {
  v.value(required({"thrust_coefficient", "N s^2/rad^2", "k_f: thrust = k_f w^2", 1e-12, 1}),
          r.thrust_coefficient);
  v.value(required({"torque_coefficient", "N m s^2/rad^2", "k_m: torque = k_m w^2", 0, 1}),
          r.torque_coefficient);
  v.value({"inertia", "kg m^2", "of one rotor about its axis", 0, 1}, r.inertia);
  v.value({"drag_coefficient", "N s^2/m/rad", "linear rotor drag: force = -c w v", 0, 1},
          r.drag_coefficient);
  v.value({"speed_min", "rad/s", "least commanded speed", 0, 1e5}, r.speed_min);
  v.value(required({"speed_max", "rad/s", "greatest commanded speed", 1, 1e5}), r.speed_max);
  v.value({"natural_frequency", "rad/s", "of the speed's response; 0: follows at once", 0, 1e4},
          r.natural_frequency);
  v.only_if(r.natural_frequency > 0.0, "natural_frequency above 0", [&](SettingsVisitor& w) {
    w.value({"damping", "", "of the speed's response", 0.1, 10}, r.damping);
  });
  v.value({"radius", "m", "of the propeller, for ground effect; 0: none", 0, 10}, r.radius);
}

void describe_loop(SettingsVisitor& v, LoopDesign& loop) {
  v.value({"natural_frequency", "rad/s", "of the closed loop", 0.01, 1000}, loop.natural_frequency);
  v.value({"damping", "", "of the closed loop", 0.1, 10}, loop.damping);
  v.value({"integral",
           "",
           "how quickly wind and the like are learnt, in units of natural_frequency",
           0,
           1},
          loop.integral);
}

/// The attitude loops: only the cascade integrates.
void describe_attitude_loop(SettingsVisitor& v, LoopDesign& loop, const ControllerSettings& c) {
  v.value({"natural_frequency", "rad/s", "of the closed loop", 0.01, 1000}, loop.natural_frequency);
  v.value({"damping", "", "of the closed loop", 0.1, 10}, loop.damping);
  v.only_if(c.kind->integrates_attitude, "controller.kind: cascade", [&](SettingsVisitor& w) {
    w.value({"integral", "", "integral gain in units of natural_frequency^3", 0, 1}, loop.integral);
  });
}

void describe_controller(SettingsVisitor& v, ControllerSettings& c) {
  v.choice({"kind", "", "cascaded PID, or geometric on SE(3)"}, c.kind);
  v.section({"horizontal", "", "position loop, x and y"},
            [&](SettingsVisitor& w) { describe_loop(w, c.horizontal); });
  v.section({"vertical", "", "position loop, z"},
            [&](SettingsVisitor& w) { describe_loop(w, c.vertical); });
  v.section({"roll_pitch", "", "attitude loop"},
            [&](SettingsVisitor& w) { describe_attitude_loop(w, c.roll_pitch, c); });
  v.section({"yaw", "", "heading loop"},
            [&](SettingsVisitor& w) { describe_attitude_loop(w, c.yaw, c); });
  v.value({"speed_max", "m/s", "of velocity and position commands", 0.1, 200}, c.speed_max);
  v.value({"tilt_max_deg", "deg", "greatest tilt; from 90 on none (geometric)", 1, 180},
          c.tilt_max_deg);
  v.value({"acceleration_max", "m/s^2", "of the position loop, horizontal", 0.1, 100},
          c.acceleration_max);
  v.value({"climb_acceleration_max", "m/s^2", "of the position loop, up", 0.1, 100},
          c.climb_acceleration_max);
  v.value({"error_max", "m", "position errors count no more than this", 0.01, 1e4}, c.error_max);
  v.value({"integral_max", "m/s^2", "position loops allow for disturbances up to this", 0, 100},
          c.integral_max);
  v.value({"body_rate_max", "rad/s", "demanded rates", 0.1, 100}, c.body_rate_max);
}

void describe_imu(SettingsVisitor& v, ImuSettings& i) {
  v.value({"rate", "Hz", "samples per second", 1, 10000}, i.rate);
  v.value({"position", "m", "in the body frame", -10, 10}, i.position);
  v.value({"rotation_rpy_deg", "deg", "roll, pitch, yaw of its axes in the body", -360, 360},
          i.rotation_rpy_deg);
  v.value({"gyro_noise_density", "rad/s/sqrt(Hz)", "white noise", 0, 1}, i.gyro_noise_density);
  v.value({"gyro_bias_walk", "rad/s^2/sqrt(Hz)", "random walk of the bias", 0, 1},
          i.gyro_bias_walk);
  v.value({"accel_noise_density", "m/s^2/sqrt(Hz)", "white noise", 0, 10}, i.accel_noise_density);
  v.value({"accel_bias_walk", "m/s^3/sqrt(Hz)", "random walk of the bias", 0, 10},
          i.accel_bias_walk);
}

void describe_battery(SettingsVisitor& v, BatterySettings& b) {
  v.value({"cells", "", "in series; 0: full power for ever", 0, 24}, b.cells);
  v.only_if(b.cells > 0.0, "cells above 0", [&](SettingsVisitor& w) {
    w.value({"capacity", "Ah", "from full to empty", 0, 1000}, b.capacity);
    w.value({"resistance", "ohm", "of all cells and leads", 0, 10}, b.resistance);
    w.value({"efficiency", "", "shaft power by electrical power", 0.05, 1}, b.efficiency);
    w.value({"reserve", "", "share of the capacity left when it counts as low", 0, 0.9}, b.reserve);
  });
}

VehicleSettings read(SettingsReader& reader, const std::string& path) {
  VehicleSettings settings;
  describe(reader, settings);
  reader.finish();
  settings.path = path;
  const auto fail = [&](const char* key, const std::string& what) {
    const auto line = reader.lines().find(key);
    throw InputError(fmt::format(
        "{}:{}: {}: {}", path, line == reader.lines().end() ? 1 : line->second, key, what));
  };
  if (settings.rotors.size() < 4) {
    fail("rotors", fmt::format("{} rotors; at least 4 are needed", settings.rotors.size()));
  }
  if (settings.shape == HullShape::kCapsule && settings.height < 2.0 * settings.radius) {
    fail("height", "less than twice the radius: that is a sphere");
  }
  if (settings.controller.tilt_max_deg > settings.controller.kind->tilt_max_deg) {
    fail("controller.tilt_max_deg", "above 85; only the geometric controller flies so");
  }
  if (settings.battery.cells > 0.0 && settings.battery.capacity <= 0.0) {
    fail("battery.capacity", "a battery with cells needs a capacity");
  }
  if (settings.rotor.speed_min >= settings.rotor.speed_max) {
    fail("rotor.speed_min", "not below speed_max");
  }
  if (settings.thrust_to_weight() <= 1.0) {
    fail("mass",
         fmt::format("thrust to weight is {:.2f}: this vehicle cannot hover",
                     settings.thrust_to_weight()));
  }
  if (settings.hover_speed() <= settings.rotor.speed_min) {
    fail("rotor.speed_min",
         fmt::format("{} rad/s already lifts more than the vehicle's weight (it hovers at {:.0f})",
                     settings.rotor.speed_min,
                     settings.hover_speed()));
  }
  return settings;
}

}  // namespace

void describe(SettingsVisitor& v, VehicleSettings& s) {
  v.value({"title", "", "what it is"}, s.title);
  v.value({"source", "", "where the figures come from"}, s.source);
  v.value(required({"mass", "kg", "with everything on board", 1e-3, 1e4}), s.mass);
  v.value(required({"inertia_diagonal", "kg m^2", "about the body axes", 1e-9, 1e4}),
          s.inertia_diagonal);
  v.choice({"shape", "", "of the hull, which must stay free"}, s.shape, kShapes);
  v.only_if(s.shape != HullShape::kBox, "shape: sphere or capsule", [&](SettingsVisitor& w) {
    w.value({"radius", "m", "of the sphere or capsule", 0.001, 100}, s.radius);
  });
  v.only_if(s.shape == HullShape::kBox, "shape: box", [&](SettingsVisitor& w) {
    w.value({"size", "m", "of the box", 0.001, 100}, s.size);
  });
  v.only_if(s.shape == HullShape::kCapsule, "shape: capsule", [&](SettingsVisitor& w) {
    w.value({"height", "m", "along z, caps included", 0.001, 100}, s.height);
  });
  v.value({"intensity", "", "of LiDAR returns from it", 0, 1e6}, s.intensity);
  v.value({"drag_area", "m^2", "c_d A along each body axis", 0, 100}, s.drag_area);
  v.section(required({"rotor", "", "all rotors are alike"}),
            [&](SettingsVisitor& w) { describe_rotor(w, s.rotor); });
  v.list(required({"rotors", "", "where they sit"}),
         s.rotors,
         [](SettingsVisitor& w, RotorPlacement& rotor) {
           w.value(required({"position", "m", "in the body frame", -10, 10}), rotor.position);
           w.value(required({"yaw_sign", "", "sign of the reaction torque about body z", -1, 1}),
                   rotor.yaw_sign);
         });
  v.choice({"lowest_command", "", "the innermost command that its autopilot takes"},
           s.lowest_command,
           kLevels);
  v.section({"controller", "", "gains follow from these and the airframe"},
            [&](SettingsVisitor& w) { describe_controller(w, s.controller); });
  v.section({"imu", "", "continuous-time densities"},
            [&](SettingsVisitor& w) { describe_imu(w, s.imu); });
  v.section({"battery", "", "LiPo; flown with where the scenario says so"},
            [&](SettingsVisitor& w) { describe_battery(w, s.battery); });
}

std::string_view to_string(CommandLevel level) {
  return name_in(kLevels, level);
}

std::string vehicle_reference() {
  VehicleSettings defaults;
  defaults.rotors.resize(1);  // so that their keys are listed
  SettingsTable table;
  describe(table, defaults);
  return table.text();
}

Solid VehicleSettings::hull() const {
  if (shape == HullShape::kBox) return Cuboid{0.5 * size};
  if (shape == HullShape::kCapsule) return Capsule{radius, 0.5 * height - radius};
  return Ball{radius};
}

double VehicleSettings::hover_speed() const {
  const double thrust = mass * kGravity / static_cast<double>(rotors.size());
  return std::sqrt(thrust / rotor.thrust_coefficient);
}

double VehicleSettings::thrust_to_weight() const {
  return static_cast<double>(rotors.size()) * rotor.thrust_coefficient * rotor.speed_max *
         rotor.speed_max / (mass * kGravity);
}

Vector3d VehicleSettings::drag_in_still_air(const Vector3d& v_body) const {
  const double rotor_drag =
      static_cast<double>(rotors.size()) * rotor.drag_coefficient * hover_speed();
  const Vector3d rotor_force = -rotor_drag * Vector3d(v_body.x(), v_body.y(), 0.0);
  const Vector3d dynamic_pressure =
      0.5 * kAirDensity * v_body.cwiseAbs().cwiseProduct(v_body);  // signed
  return (rotor_force - drag_area.cwiseProduct(dynamic_pressure)) / mass;
}

VehicleSettings load_vehicle(const std::string& name_or_path, const std::string& base) {
  const std::string path = find_model("vehicles", name_or_path, base);
  SettingsReader reader(path);
  return read(reader, path);
}

VehicleSettings parse_vehicle(std::string_view text, const std::string& path) {
  SettingsReader reader(text, path);
  return read(reader, path);
}

}  // namespace pointflight
