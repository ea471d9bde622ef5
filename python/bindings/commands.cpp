// What vehicles are told: each command of vehicle/command.hpp as a class of its own.
#include <pybind11/stl.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pointflight/vehicle/command.hpp"
#include "python/bindings/arrays.hpp"
#include "python/bindings/run_objects.hpp"

namespace pointflight::python {
namespace {

/// Its class, to be called with what its properties of these names say.
template <class C>
py::tuple again(const py::object& self, const std::vector<const char*>& names) {
  py::list arguments;
  for (const char* name : names) arguments.append(self.attr(name));
  return py::make_tuple(py::type::of<C>(), py::tuple(arguments));
}

/// `names`: properties that are its constructor's arguments, in their order, for pickles.
template <class C>
py::class_<C> command_class(py::module_& module,
                            const char* name,
                            const char* doc,
                            const std::vector<const char*>& names) {
  py::class_<C> bound(module, name, doc);
  bound.def("__reduce__", [names](const py::object& self) { return again<C>(self, names); });
  bound.def("__repr__",
            [name](const C& /*command*/) { return "<" + std::string(name) + " command>"; });
  return bound;
}

/// Waypoints (n, 3).
std::vector<Vector3d> rows_from(const Array<double>& points, const char* name) {
  const Array<double> rows = rows_of_three(points, name);
  std::vector<Vector3d> vectors;
  for (py::ssize_t i = 0; i < rows.shape(0); ++i) {
    vectors.emplace_back(rows.at(i, 0), rows.at(i, 1), rows.at(i, 2));
  }
  return vectors;
}

void add_setpoints(py::module_& module) {
  command_class<RotorSpeedCommand>(module,
                                   "RotorSpeeds",
                                   "Speeds of all rotors, rad/s, in the order of the vehicle file. "
                                   "Must be repeated, as all up to Position.",
                                   {"speeds"})
      .def(py::init([](const Array<double>& speeds) {
             require_shape(speeds, "speeds", {-1});
             return RotorSpeedCommand{{speeds.data(), speeds.data() + speeds.size()}};
           }),
           py::arg("speeds"))
      .def_property_readonly(
          "speeds",
          [](const RotorSpeedCommand& c) {
            return py::array_t<double>(static_cast<py::ssize_t>(c.speeds.size()), c.speeds.data());
          },
          "(n,): rad/s.");
  command_class<BodyRateCommand>(
      module,
      "BodyRates",
      "Rates about the body's axes (rad/s) and total thrust along body z (N).",
      {"rates", "thrust"})
      .def(py::init([](const Array<double>& rates, double thrust) {
             return BodyRateCommand{vector_from(rates, "rates"), thrust};
           }),
           py::arg("rates"),
           py::arg("thrust"))
      .def_property_readonly(
          "rates",
          [](const BodyRateCommand& c) { return array_of(c.omega_body); },
          "(3,): rad/s, body.")
      .def_property_readonly(
          "thrust", [](const BodyRateCommand& c) { return c.thrust; }, "N");
  command_class<AttitudeCommand>(
      module,
      "Attitude",
      "Attitude (x, y, z, w) and total thrust along body z (N); rates (rad/s) are feed-forward.",
      {"orientation", "thrust", "rates"})
      .def(
          py::init([](const Array<double>& orientation, double thrust, const Array<double>& rates) {
            require_shape(orientation, "orientation", {4});
            const Quaterniond q(
                orientation.at(3), orientation.at(0), orientation.at(1), orientation.at(2));
            if (!(q.norm() > 1e-6)) throw py::value_error("orientation: x y z w are all zero");
            return AttitudeCommand{q.normalized(), thrust, vector_from(rates, "rates")};
          }),
          py::arg("orientation"),
          py::arg("thrust"),
          py::arg("rates") = py::make_tuple(0.0, 0.0, 0.0))
      .def_property_readonly(
          "orientation",
          [](const AttitudeCommand& c) { return array_of(c.q_world_body); },
          "(4,): x, y, z, w.")
      .def_property_readonly(
          "thrust", [](const AttitudeCommand& c) { return c.thrust; }, "N")
      .def_property_readonly(
          "rates",
          [](const AttitudeCommand& c) { return array_of(c.omega_body); },
          "(3,): rad/s, body.");
  command_class<AccelerationCommand>(module,
                                     "Acceleration",
                                     "Acceleration without gravity (zero hovers), m/s^2, world, "
                                     "and heading, rad from world x towards y.",
                                     {"acceleration", "yaw", "yaw_rate"})
      .def(py::init([](const Array<double>& acceleration, double yaw, double yaw_rate) {
             return AccelerationCommand{vector_from(acceleration, "acceleration"), yaw, yaw_rate};
           }),
           py::arg("acceleration"),
           py::arg("yaw") = 0.0,
           py::arg("yaw_rate") = 0.0)
      .def_property_readonly(
          "acceleration",
          [](const AccelerationCommand& c) { return array_of(c.a_world); },
          "(3,): m/s^2, world.")
      .def_property_readonly(
          "yaw", [](const AccelerationCommand& c) { return c.yaw; }, "rad")
      .def_property_readonly(
          "yaw_rate", [](const AccelerationCommand& c) { return c.yaw_rate; }, "rad/s");
  command_class<VelocityCommand>(
      module,
      "Velocity",
      "Velocity, m/s, world, or along the level body axes (ahead, left, up) with `in_body`. "
      "Without `yaw` it turns at `yaw_rate` (rad/s) from its present heading on.",
      {"velocity", "yaw", "yaw_rate", "in_body"})
      .def(py::init([](const Array<double>& velocity,
                       const std::optional<double>& yaw,
                       double yaw_rate,
                       bool in_body) {
             return VelocityCommand{
                 vector_from(velocity, "velocity"), yaw.value_or(0.0), yaw_rate, !yaw, in_body};
           }),
           py::arg("velocity"),
           py::arg("yaw") = py::none(),
           py::arg("yaw_rate") = 0.0,
           py::arg("in_body") = false)
      .def_property_readonly(
          "velocity", [](const VelocityCommand& c) { return array_of(c.v_world); }, "(3,): m/s.")
      .def_property_readonly(
          "yaw",
          [](const VelocityCommand& c) { return c.turn ? std::nullopt : std::optional(c.yaw); },
          "rad; None: it turns.")
      .def_property_readonly(
          "yaw_rate", [](const VelocityCommand& c) { return c.yaw_rate; }, "rad/s")
      .def_property_readonly(
          "in_body",
          [](const VelocityCommand& c) { return c.in_body; },
          "Along the level body axes.");
  command_class<PositionCommand>(
      module,
      "Position",
      "Where to be (m, world), and how to move there; derivatives are feed-forward.",
      {"position", "velocity", "acceleration", "yaw", "yaw_rate"})
      .def(py::init([](const Array<double>& position,
                       const Array<double>& velocity,
                       const Array<double>& acceleration,
                       double yaw,
                       double yaw_rate) {
             PositionCommand command;
             command.p_world = vector_from(position, "position");
             command.v_world = vector_from(velocity, "velocity");
             command.a_world = vector_from(acceleration, "acceleration");
             command.yaw = yaw;
             command.yaw_rate = yaw_rate;
             return command;
           }),
           py::arg("position"),
           py::arg("velocity") = py::make_tuple(0.0, 0.0, 0.0),
           py::arg("acceleration") = py::make_tuple(0.0, 0.0, 0.0),
           py::arg("yaw") = 0.0,
           py::arg("yaw_rate") = 0.0)
      .def_property_readonly(
          "position",
          [](const PositionCommand& c) { return array_of(c.p_world); },
          "(3,): m, world.")
      .def_property_readonly(
          "velocity", [](const PositionCommand& c) { return array_of(c.v_world); }, "(3,): m/s.")
      .def_property_readonly(
          "acceleration",
          [](const PositionCommand& c) { return array_of(c.a_world); },
          "(3,): m/s^2.")
      .def_property_readonly(
          "yaw", [](const PositionCommand& c) { return c.yaw; }, "rad")
      .def_property_readonly(
          "yaw_rate", [](const PositionCommand& c) { return c.yaw_rate; }, "rad/s");
}

/// Control points (n, 4): x, y, z, yaw.
std::vector<Eigen::Vector4d> control_points(const Array<double>& points) {
  require_shape(points, "points", {-1, 4});
  std::vector<Eigen::Vector4d> rows;
  for (py::ssize_t i = 0; i < points.shape(0); ++i) {
    rows.emplace_back(points.at(i, 0), points.at(i, 1), points.at(i, 2), points.at(i, 3));
  }
  return rows;
}

TrajectoryCommand b_spline(const Array<double>& points, double interval, int degree) {
  return {BSplineTrajectory::uniform(control_points(points), degree, interval)};
}

/// The same with knots of their own.
TrajectoryCommand spline_with_knots(const Array<double>& points,
                                    int degree,
                                    const std::vector<double>& knots) {
  return {std::make_shared<BSplineTrajectory>(control_points(points), degree, knots)};
}

/// What makes the same again, for pickles: a function of the class, and its arguments.
py::tuple parts_of(const TrajectoryCommand& command) {
  if (const auto* spline = dynamic_cast<const BSplineTrajectory*>(command.trajectory.get())) {
    std::vector<double> rows;
    for (const Eigen::Vector4d& p : spline->points()) rows.insert(rows.end(), p.begin(), p.end());
    const auto count = static_cast<py::ssize_t>(spline->points().size());
    return py::make_tuple(
        "_spline",
        py::make_tuple(
            array_of(std::move(rows), {count, py::ssize_t{4}}), spline->degree(), spline->knots()));
  }
  const auto& pieces = dynamic_cast<const PolynomialTrajectory&>(*command.trajectory).pieces();
  std::size_t powers = 0;
  for (const auto& piece : pieces) {
    for (const auto& axis : piece.coefficients) powers = std::max(powers, axis.size());
  }
  std::vector<double> durations;
  std::vector<double> coefficients;
  for (const auto& piece : pieces) {
    durations.push_back(piece.duration);
    for (const auto& axis : piece.coefficients) {
      coefficients.insert(coefficients.end(), axis.begin(), axis.end());
      coefficients.resize(coefficients.size() + powers - axis.size(), 0.0);
    }
  }
  const auto count = static_cast<py::ssize_t>(pieces.size());
  const auto width = static_cast<py::ssize_t>(powers);
  return py::make_tuple(
      "polynomials",
      py::make_tuple(array_of(std::move(durations), {count}),
                     array_of(std::move(coefficients), {count, py::ssize_t{4}, width})));
}

/// durations (n,), coefficients (n, 4, k): x, y, z, yaw by rising powers.
TrajectoryCommand polynomials(const Array<double>& durations, const Array<double>& coefficients) {
  require_shape(durations, "durations", {-1});
  require_shape(coefficients, "coefficients", {durations.shape(0), 4, -1});
  std::vector<PolynomialTrajectory::Piece> pieces;
  for (py::ssize_t i = 0; i < durations.shape(0); ++i) {
    PolynomialTrajectory::Piece& piece = pieces.emplace_back();
    piece.duration = durations.at(i);
    for (py::ssize_t axis = 0; axis < 4; ++axis) {
      for (py::ssize_t k = 0; k < coefficients.shape(2); ++k) {
        piece.coefficients[static_cast<std::size_t>(axis)].push_back(coefficients.at(i, axis, k));
      }
    }
  }
  return {std::make_shared<PolynomialTrajectory>(std::move(pieces))};
}

}  // namespace

void add_commands(py::module_& module) {
  add_setpoints(module);
  command_class<TrajectoryCommand>(
      module, "Trajectory", "A path in time, followed from now on.", {})
      .def_static(
          "b_spline",
          &b_spline,
          py::arg("points"),
          py::arg("interval"),
          py::arg("degree") = 3,
          "Control points (n, 4): x, y, z in m, yaw in rad; knots every `interval` seconds.")
      .def_static("polynomials",
                  &polynomials,
                  py::arg("durations"),
                  py::arg("coefficients"),
                  "Pieces of durations (n,) in s, and coefficients (n, 4, k) of x, y, z, yaw by "
                  "rising powers of the time.")
      .def_static(
          "_spline", &spline_with_knots, py::arg("points"), py::arg("degree"), py::arg("knots"))
      .def_property_readonly("_parts", &parts_of)
      .def_property_readonly(
          "duration", [](const TrajectoryCommand& c) { return c.trajectory->duration(); }, "s");
  command_class<WaypointCommand>(
      module,
      "Waypoints",
      "Fly through points (n, 3), m, world, straight and at rest at each.",
      {"points", "speed"})
      .def(py::init([](const Array<double>& points, double speed) {
             WaypointCommand command;
             command.mission.waypoints = rows_from(points, "points");
             command.mission.motion.speed = speed;
             return command;
           }),
           py::arg("points"),
           py::arg("speed") = MotionLimits{}.speed)
      .def_property_readonly(
          "points",
          [](const WaypointCommand& c) {
            std::vector<double> rows;
            for (const Vector3d& p : c.mission.waypoints)
              rows.insert(rows.end(), p.begin(), p.end());
            const auto count = static_cast<py::ssize_t>(c.mission.waypoints.size());
            return array_of(std::move(rows), {count, py::ssize_t{3}});
          },
          "(n, 3): m, world.")
      .def_property_readonly(
          "speed", [](const WaypointCommand& c) { return c.mission.motion.speed; }, "m/s");
  command_class<TakeOffCommand>(module,
                                "TakeOff",
                                "Rise by `height` (m) from the present position; arms.",
                                {"height", "speed"})
      .def(py::init([](double height, double speed) {
             return TakeOffCommand{height, speed};
           }),
           py::arg("height") = TakeOffCommand{}.height,
           py::arg("speed") = TakeOffCommand{}.speed)
      .def_property_readonly(
          "height", [](const TakeOffCommand& c) { return c.height; }, "m")
      .def_property_readonly(
          "speed", [](const TakeOffCommand& c) { return c.speed; }, "m/s");
  command_class<LandCommand>(module,
                             "Land",
                             "Come down until something carries the vehicle, then stop the rotors.",
                             {"speed"})
      .def(py::init([](double speed) { return LandCommand{speed}; }),
           py::arg("speed") = LandCommand{}.speed)
      .def_property_readonly(
          "speed", [](const LandCommand& c) { return c.speed; }, "m/s");
  command_class<HoverCommand>(module, "Hover", "Brake and stay.", {}).def(py::init<>());
  command_class<ArmCommand>(module, "Arm", "Rotors idle on the ground; in the air: hover.", {})
      .def(py::init<>());
  command_class<DisarmCommand>(module, "Disarm", "Rotors off, wherever it is.", {})
      .def(py::init<>());
}

}  // namespace pointflight::python
