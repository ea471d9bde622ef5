#include "pointflight/sim/command_script.hpp"

#include <fmt/format.h>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/geometry/rotation.hpp"

namespace pointflight {
namespace {

/// Groups of keys that lines of several commands have.
enum Keys : unsigned {
  kVector = 1 << 0,
  kMoves = 1 << 1,  // with kVector: a position, which moves with the vehicle's copies
  kHeading = 1 << 2,
  kThrust = 1 << 3,
  kRates = 1 << 4,
  kFeedForward = 1 << 5,
  kRpy = 1 << 6,
  kRotors = 1 << 7,
  kHeight = 1 << 8,
  kSpeed = 1 << 9,
  kFile = 1 << 10,
  kKnots = 1 << 11,
};

using Settings = const CommandSettings&;
using Context = const CommandContext&;

double thrust_of(Settings s, Context c) {
  return s.thrust > 0.0 ? s.thrust : c.vehicle.mass * kGravity;
}

Command rotor_speeds(Settings s, Context /*c*/) {
  return RotorSpeedCommand{s.rotors};
}
Command body_rates(Settings s, Context c) {
  return BodyRateCommand{s.rates_deg * kDegree, thrust_of(s, c)};
}
Command attitude(Settings s, Context c) {
  const Vector3d rpy = s.rpy_deg * kDegree;
  return AttitudeCommand{
      quaternion_from_rpy(rpy.x(), rpy.y(), rpy.z()), thrust_of(s, c), Vector3d::Zero()};
}
Command acceleration(Settings s, Context /*c*/) {
  return AccelerationCommand{s.vector, s.yaw_deg * kDegree, s.yaw_rate_deg * kDegree};
}
Command velocity(Settings s, Context /*c*/) {
  return VelocityCommand{s.vector, s.yaw_deg * kDegree, s.yaw_rate_deg * kDegree};
}
Command position(Settings s, Context /*c*/) {
  PositionCommand command;
  command.p_world = s.vector;
  command.v_world = s.feed_forward;
  command.yaw = s.yaw_deg * kDegree;
  command.yaw_rate = s.yaw_rate_deg * kDegree;
  return command;
}
Command polynomial(Settings s, Context c) {
  return TrajectoryCommand{PolynomialTrajectory::read(resolve_path(s.file, c.folder))};
}
Command b_spline(Settings s, Context c) {
  return TrajectoryCommand{BSplineTrajectory::read(
      resolve_path(s.file, c.folder), static_cast<int>(s.degree), s.interval)};
}
Command waypoint(Settings s, Context c) {
  WaypointCommand command;
  command.mission.motion = c.motion;
  command.mission.waypoints = {s.vector};
  return command;
}
Command take_off(Settings s, Context /*c*/) {
  return TakeOffCommand{s.height, s.speed};
}
Command land(Settings s, Context /*c*/) {
  return LandCommand{s.speed};
}
template <class C>
Command plain(Settings /*s*/, Context /*c*/) {
  return C{};
}

}  // namespace

Registry<ScriptedCommand>& ScriptedCommand::table() {
  static Registry<ScriptedCommand> table = {
      {"rotor_speeds", kRotors, rotor_speeds},
      {"body_rates", kRates | kThrust, body_rates},
      {"attitude", kRpy | kThrust, attitude},
      {"acceleration", kVector | kHeading, acceleration},
      {"velocity", kVector | kHeading, velocity},
      {"position", kVector | kMoves | kFeedForward | kHeading, position},
      {"polynomial", kFile, polynomial},
      {"b_spline", kFile | kKnots, b_spline},
      {"waypoint", kVector | kMoves, waypoint},
      {"take_off", kHeight | kSpeed, take_off},
      {"land", kSpeed, land},
      {"hover", 0, plain<HoverCommand>},
      {"arm", 0, plain<ArmCommand>},
      {"disarm", 0, plain<DisarmCommand>},
  };
  return table;
}

bool moves_with_copies(const CommandSettings& settings) {
  return (settings.kind->keys & kMoves) != 0;
}

void describe(SettingsVisitor& v, CommandSettings& s) {
  v.value({"time", "s", "when it is given", 0, 1e6}, s.time);
  v.choice({"kind", "", "what is commanded"}, s.kind);
  // the keys of a group, if the command has it
  const auto group = [&](Keys keys, const auto& describe_keys, const char* hint = "") {
    std::string names;
    for (const ScriptedCommand& row : ScriptedCommand::table().rows()) {
      if ((row.keys & keys) != 0) names += (names.empty() ? "" : ", ") + row.name;
    }
    v.only_if((s.kind->keys & keys) != 0, fmt::format("kind: {}{}", names, hint), describe_keys);
  };
  group(
      kVector,
      [&](SettingsVisitor& w) {
        w.value({"vector",
                 "",
                 "acceleration m/s^2, velocity m/s, position or waypoint m",
                 -kFarthest,
                 kFarthest},
                s.vector);
      },
      "; body_rates has rates_deg");
  group(kRates, [&](SettingsVisitor& w) {
    w.value({"rates_deg", "deg/s", "about the body's axes", -36000, 36000}, s.rates_deg);
  });
  group(kFeedForward, [&](SettingsVisitor& w) {
    w.value({"feed_forward", "m/s", "velocity of the command", -100, 100}, s.feed_forward);
  });
  group(kRpy, [&](SettingsVisitor& w) {
    w.value({"rpy_deg", "deg", "the attitude", -360, 360}, s.rpy_deg);
  });
  group(kHeading, [&](SettingsVisitor& w) {
    w.value({"yaw_deg", "deg", "heading", -360, 360}, s.yaw_deg);
    w.value({"yaw_rate_deg", "deg/s", "feed-forward", -720, 720}, s.yaw_rate_deg);
  });
  group(kThrust, [&](SettingsVisitor& w) {
    w.value({"thrust", "N", "0: the weight", 0, 1e5}, s.thrust);
  });
  group(kRotors, [&](SettingsVisitor& w) {
    w.value({"rotors", "rad/s", "of each", 0, 1e5}, s.rotors);
  });
  group(kHeight, [&](SettingsVisitor& w) {
    w.value({"height", "m", "to rise by", 0.01, 1e4}, s.height);
  });
  group(kSpeed, [&](SettingsVisitor& w) {
    w.value({"speed", "m/s", "up or down", 0.01, 20}, s.speed);
  });
  group(kFile, [&](SettingsVisitor& w) {
    w.value({"file", "", "CSV of a polynomial or of a B-spline's control points"}, s.file);
  });
  group(kKnots, [&](SettingsVisitor& w) {
    w.value({"degree", "", "of the B-spline", 1, 7}, s.degree);
    w.value({"interval", "s", "between the B-spline's knots", 0.001, 1000}, s.interval);
  });
}

}  // namespace pointflight
