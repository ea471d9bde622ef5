#include "pointflight/vehicle/airframe.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/vehicle/command.hpp"

namespace pointflight {
namespace {

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
  v.value(
      {"radius", "m", "of the propeller, for ground effect and advance ratio; 0: neither", 0, 10},
      r.radius);
  v.only_if(r.radius > 0.0, "radius above 0", [&](SettingsVisitor& w) {
    w.value({"advance_ratios",
             "",
             "J = v / (n D), ascending, v along the axis; empty: thrust does not depend on v",
             -10,
             10},
            r.advance_ratios);
    w.value({"thrust_shares", "", "C_T(J) / C_T(0) at these advance ratios", -2, 3},
            r.thrust_shares);
    w.value({"torque_shares", "", "C_P(J) / C_P(0) at these advance ratios", -2, 3},
            r.torque_shares);
  });
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
  v.value({"reallocate", "", "the other rotors take over from one that fails"}, c.reallocate);
  v.value({"body_rate_max", "rad/s", "demanded rates", 0.1, 100}, c.body_rate_max);
}

void describe_imu(SettingsVisitor& v, ImuSettings& i) {
  v.value({"rate", "Hz", "samples per second", 1, 10000}, i.rate);
  v.value({"position", "m", "in the body frame", -10, 10}, i.position);
  v.value({"rotation_rpy_deg", "deg", "roll, pitch, yaw of its axes in the body", -360, 360},
          i.rotation_rpy_deg);
  v.value({"part", "", "name of a shipped part (below), whose errors it has"}, i.part);
  v.only_if(i.part.empty(), "no `part`", [&](SettingsVisitor& w) {
    describe_noise(w, i.errors);
    describe_beyond_noise(w, i.errors);
  });
}

void describe_vibration(SettingsVisitor& v, VibrationSettings& s) {
  v.value({"rotor_accel", "m/s^2", "amplitude across the axis by each rotor's imbalance", 0, 1000},
          s.rotor_accel);
  v.value({"blade_accel", "m/s^2", "amplitude along the axis at the blades' frequency", 0, 1000},
          s.blade_accel);
  v.value({"rotor_gyro", "rad/s", "amplitude of rates by each rotor's imbalance", 0, 10},
          s.rotor_gyro);
  v.value({"blades", "", "of each propeller", 1, 16}, s.blades);
}

void describe_looks(SettingsVisitor& v, AirframeSettings& s) {
  v.value({"seen_as_hull", "", "LiDARs see the hull, as a solid"}, s.seen_as_hull);
  v.only_if(!s.seen_as_hull, "seen_as_hull: false", [&](SettingsVisitor& w) {
    w.value({"body_size", "m", "of the box in the middle", 0, 10}, s.body_size);
    w.value({"body_center", "m", "of the box, in the body frame", -10, 10}, s.body_center);
    w.value({"arm_radius", "m", "of the arms, one for each rotor", 0, 1}, s.arm_radius);
    w.value({"propeller_radius", "m", "0: rotor.radius; without that no propellers", 0, 10},
            s.propeller_radius);
    w.value({"blade_chord", "m", "width of the propellers' blades (vibration.blades)", 0, 1},
            s.blade_chord);
    w.value({"blade_pitch_deg", "deg", "of the blades against the disc", 0, 80}, s.blade_pitch_deg);
  });
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

template <class Fail>
void check_rotor_curves(const RotorModel& r, const Fail& fail) {
  const std::size_t n = r.advance_ratios.size();
  if (r.thrust_shares.size() != n || r.torque_shares.size() != n) {
    fail("rotor.advance_ratios",
         fmt::format(
             "{} of these, {} thrust_shares and {} torque_shares; as many of each are wanted",
             n,
             r.thrust_shares.size(),
             r.torque_shares.size()));
  }
  if (n == 1) fail("rotor.advance_ratios", "one alone; two or more are wanted, or none");
  for (std::size_t i = 1; i < n; ++i) {
    if (r.advance_ratios[i] <= r.advance_ratios[i - 1]) {
      fail("rotor.advance_ratios", "not in ascending order");
    }
    // else no speed, or two, would give a thrust
    if (r.thrust_shares[i] > r.thrust_shares[i - 1] || r.thrust_shares[0] <= 0.0) {
      fail("rotor.thrust_shares", "these fall with the advance ratio, from above 0");
    }
  }
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
  if (settings.rotors.size() > kMostRotors) {
    fail("rotors", fmt::format("{} rotors; {} at most", settings.rotors.size(), kMostRotors));
  }
  const SolidSize& hull = settings.hull_size;
  const char* fault = fault_of_height(*settings.shape, hull.height, hull.radius);
  if (fault != nullptr) fail("height", fault);
  if (settings.controller.tilt_max_deg > settings.controller.kind->tilt_max_deg) {
    fail("controller.tilt_max_deg", "above 85; only the geometric controller flies so");
  }
  if (settings.battery.cells > 0.0 && settings.battery.capacity <= 0.0) {
    fail("battery.capacity", "a battery with cells needs a capacity");
  }
  check_rotor_curves(settings.rotor, fail);
  if (settings.rotor.speed_min >= settings.rotor.speed_max) {
    fail("rotor.speed_min", "not below speed_max");
  }
  if (!settings.imu.part.empty()) {
    try {
      settings.imu.part_errors = load_imu_part(settings.imu.part).errors;
    } catch (const InputError& error) {
      fail("imu.part", error.what());
    }
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
  v.choice({"shape", "", "of the hull, which must stay free"}, s.shape);
  describe_solid(v, &*s.shape, s.hull_size, 100.0);
  v.value({"intensity", "", "of LiDAR returns from it", 0, 1e6}, s.intensity);
  v.value({"drag_area", "m^2", "c_d A along each body axis", 0, 100}, s.drag_area);
  v.value({"rotational_drag", "N m s^2", "K about each body axis: torque = -K |w| w", 0, 10},
          s.rotational_drag);
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
           setpoint_names());
  v.section({"controller", "", "gains follow from these and the airframe"},
            [&](SettingsVisitor& w) { describe_controller(w, s.controller); });
  v.section({"imu", "", "continuous-time densities"},
            [&](SettingsVisitor& w) { describe_imu(w, s.imu); });
  v.section({"vibration", "", "that the rotors give the IMU, at hover speed"},
            [&](SettingsVisitor& w) { describe_vibration(w, s.vibration); });
  v.section({"battery", "", "LiPo; flown with where the scenario says so"},
            [&](SettingsVisitor& w) { describe_battery(w, s.battery); });
  v.section({"airframe", "", "what LiDARs see of it; what is 0 follows from where the rotors sit"},
            [&](SettingsVisitor& w) { describe_looks(w, s.airframe); });
}

std::string vehicle_reference() {
  VehicleSettings defaults;
  defaults.rotors.resize(1);  // so that their keys are listed
  SettingsTable table;
  describe(table, defaults);
  return table.text();
}

Solid VehicleSettings::hull() const {
  return shape->make(hull_size);
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
