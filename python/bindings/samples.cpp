// What a run says, as objects: each sample of sim/samples.hpp as a class of its own.
#include "pointflight/sim/samples.hpp"

#include <pybind11/stl.h>

#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "python/bindings/arrays.hpp"
#include "python/bindings/run_objects.hpp"

namespace pointflight::python {
namespace {

/// `time` in seconds and `time_ns`, exact.
template <class S, class TimeOf>
void add_time(py::class_<S>& bound, const TimeOf& time_of) {
  bound.def_property_readonly(
      "time",
      [time_of](const S& s) { return to_seconds(time_of(s)); },
      "s since the start of the run.");
  bound.def_property_readonly(
      "time_ns",
      [time_of](const S& s) { return time_of(s).time_since_epoch().count(); },
      "The same, exact, in nanoseconds.");
}

template <class S>
py::class_<S> sample_class(py::module_& module, const char* name, const char* doc) {
  py::class_<S> bound(module, name, doc);
  add_time(bound, [](const S& s) { return s.time; });
  if constexpr (requires(const S& s) { s.vehicle; }) {
    bound.def_readonly("vehicle", &S::vehicle, "Number in the fleet, from 0.");
  }
  bound.def("__repr__", [name](const S& s) {
    return "<" + std::string(name) + " at " + std::to_string(to_seconds(s.time)) + " s>";
  });
  return bound;
}

/// position, velocity, orientation, angular_velocity, pose of a rigid body.
template <class S, class BodyOf>
void add_body(py::class_<S>& bound, const BodyOf& body, const std::string& prefix = "") {
  bound
      .def_property_readonly((prefix + "position").c_str(),
                             [body](const S& s) { return array_of(body(s).p_world); },
                             "(3,): m, world.")
      .def_property_readonly((prefix + "velocity").c_str(),
                             [body](const S& s) { return array_of(body(s).v_world); },
                             "(3,): m/s, world.")
      .def_property_readonly((prefix + "orientation").c_str(),
                             [body](const S& s) { return array_of(body(s).q_world_body); },
                             "(4,): x, y, z, w: body axes in the world.")
      .def_property_readonly((prefix + "angular_velocity").c_str(),
                             [body](const S& s) { return array_of(body(s).omega_body); },
                             "(3,): rad/s, body.")
      .def_property_readonly((prefix + "pose").c_str(),
                             [body](const S& s) { return array_of(body(s).T_world_body()); },
                             "(4, 4): T_world_body.");
}

py::array_t<double> speeds_of(const std::vector<RotorState>& rotors) {
  std::vector<double> speeds;
  for (const RotorState& rotor : rotors) speeds.push_back(rotor.speed);
  const auto count = static_cast<py::ssize_t>(speeds.size());
  return array_of(std::move(speeds), {count});
}

py::array_t<double> copy_of(const std::vector<double>& values) {
  return py::array_t<double>(static_cast<py::ssize_t>(values.size()), values.data());
}

void add_truth(py::module_& module) {
  py::class_<RigidBodyState> body(
      module, "BodyState", "Where a body is and how it moves: what a controller sees.");
  add_body(body, [](const RigidBodyState& s) -> const RigidBodyState& { return s; });
  auto state = sample_class<StateSample>(
      module,
      "StateSample",
      "Truth at an instant, at output.trajectory_rate, the state at time zero first.");
  add_body(state, [](const StateSample& s) -> const RigidBodyState& { return s.state.body; });
  state
      .def_property_readonly(
          "rotor_speeds",
          [](const StateSample& s) { return speeds_of(s.state.rotors); },
          "(n,): rad/s.")
      .def_property_readonly(
          "commanded_position",
          [](const StateSample& s) { return array_of(s.command.p_world); },
          "(3,): what the autopilot asked for, m.")
      .def_property_readonly(
          "commanded_velocity",
          [](const StateSample& s) { return array_of(s.command.v_world); },
          "(3,): m/s.")
      .def_property_readonly(
          "clearance",
          [](const StateSample& s) {
            return s.nearest ? std::optional(s.nearest->distance) : std::nullopt;
          },
          "Of the hull to anything, m, negative inside; None beyond 10 m.")
      .def_property_readonly(
          "nearest_label",
          [](const StateSample& s) {
            return s.nearest ? std::optional(s.nearest->label) : std::nullopt;
          },
          "What that is: 0 the map, from 1 on vehicles, from 10001 on obstacles.");
  auto status = sample_class<StatusSample>(
      module, "StatusSample", "How a vehicle fares, ten times a second.");
  add_body(status, [](const StatusSample& s) -> const RigidBodyState& { return s.state; });
  status.def_readonly("crashed", &StatusSample::crashed, "Rotors off for good.")
      .def_readonly("landed", &StatusSample::landed, "The ground carries it.")
      .def_readonly("touches", &StatusSample::touches, "Its hull is in contact with something.")
      .def_readonly("armed", &StatusSample::armed, "Its rotors may turn.")
      .def_readonly("command", &StatusSample::command, "What it was told last, in a word.")
      .def_readonly("clearance", &StatusSample::clearance, "m; None beyond 10 m.")
      .def_readonly("collisions", &StatusSample::collisions, "So far.")
      .def_readonly("scans", &StatusSample::scans, "Delivered so far.")
      .def_readonly("rejected", &StatusSample::rejected, "Commands that it did not take.")
      .def_readonly("last_rejection", &StatusSample::last_rejection, "Why; empty if it took all.")
      .def_readonly("timeouts", &StatusSample::timeouts, "Times that commands stopped coming.");
}

void add_measurements(py::module_& module) {
  auto odometry = sample_class<OdometrySample>(
      module,
      "OdometrySample",
      "What an odometry on board reports at output.odometry_rate, and the truth.");
  add_body(odometry, [](const OdometrySample& s) -> const RigidBodyState& { return s.state; });
  add_body(
      odometry, [](const OdometrySample& s) -> const RigidBodyState& { return s.truth; }, "true_");
  odometry.def_property_readonly(
      "delivered",
      [](const OdometrySample& s) { return to_seconds(s.delivered); },
      "When it arrived, s.");
  sample_class<ImuSample>(module, "ImuSample", "What the IMU measures.")
      .def_property_readonly(
          "gyro", [](const ImuSample& s) { return array_of(s.gyro); }, "(3,): rad/s, IMU axes.")
      .def_property_readonly(
          "accel",
          [](const ImuSample& s) { return array_of(s.accel); },
          "(3,): specific force, m/s^2, IMU axes: 9.81 on z when level and at rest.")
      .def_property_readonly(
          "stamp",
          [](const ImuSample& s) { return to_seconds(s.stamp); },
          "What its own clock says that was, s.")
      .def_property_readonly(
          "orientation",
          [](const ImuSample& s) { return array_of(s.q_world_imu); },
          "(4,): x, y, z, w: the true attitude of its axes.");
  sample_class<Measurement>(module, "Measurement", "What any other sensor measures.")
      .def_readonly("sensor", &Measurement::sensor, "Number in `Simulation.sensors`.")
      .def_property_readonly(
          "delivered",
          [](const Measurement& s) { return to_seconds(s.delivered); },
          "When it arrived, s.")
      .def_property_readonly(
          "values",
          [](const Measurement& s) { return copy_of(s.values); },
          "(n,): by the kind's columns.");
}

void add_scans(py::module_& module) {
  py::class_<ScanSample> scan(
      module, "ScanSample", "One scan of a LiDAR, delivered when all its beams are known.");
  add_time(scan, [](const ScanSample& s) { return s.scan->end; });
  scan.def_property_readonly(
          "vehicle",
          [](const ScanSample& s) { return s.scan->vehicle; },
          "Number in the fleet, from 0.")
      .def_property_readonly(
          "sensor",
          [](const ScanSample& s) { return s.scan->sensor; },
          "Number of the LiDAR on the vehicle.")
      .def_property_readonly(
          "index",
          [](const ScanSample& s) { return s.scan->index; },
          "Number of the scan since time zero; lost ones are counted.")
      .def_property_readonly(
          "start",
          [](const ScanSample& s) { return to_seconds(s.scan->start); },
          "s since the start of the run; `time` is its end.")
      .def_property_readonly(
          "start_ns",
          [](const ScanSample& s) { return s.scan->start.time_since_epoch().count(); },
          "The same, exact, in nanoseconds.")
      .def_property_readonly(
          "beams", [](const ScanSample& s) { return s.scan->beams; }, "How many were fired.")
      .def("__len__", [](const ScanSample& s) { return s.scan->points.size(); })
      .def_property_readonly(
          "scan",
          [](const ScanSample& s) {
            const py::tuple rows = rows_of_scan(*s.scan);
            return py::module_::import("pointflight.lidar").attr("scan_of")(*rows);
          },
          "Its points: a new `Scan` each time.")
      .def(
          "pose_at",
          [](const ScanSample& s, double time) {
            const bool known =
                time >= to_seconds(s.scan->start) - 1e-9 && time <= to_seconds(s.scan->end) + 1e-9;
            if (!known) throw py::value_error("time: from the scan's start to its end is known");
            return array_of(s.T_world_sensor.at(SimTime(from_seconds(time))));
          },
          py::arg("time"),
          "(4, 4): T_world_sensor at a time from the start to the end of the scan, s since the "
          "start of the run.")
      .def("__repr__", [](const ScanSample& s) {
        return "<ScanSample " + std::to_string(s.scan->index) + ": " +
               std::to_string(s.scan->points.size()) + " points at " +
               std::to_string(to_seconds(s.scan->end)) + " s>";
      });
}

void add_events(py::module_& module) {
  sample_class<CollisionEvent>(
      module, "CollisionEvent", "A vehicle's hull hit something, or left it again.")
      .def_readonly("partner",
                    &CollisionEvent::partner,
                    "What it hit: 0 the map, from 1 on vehicles, from 10001 on obstacles.")
      .def_readonly("entered", &CollisionEvent::entered, "False: it came free again.")
      .def_readonly("penetration", &CollisionEvent::penetration, "m, at the end of the step.")
      .def_property_readonly(
          "vehicle_position",
          [](const CollisionEvent& s) { return array_of(s.vehicle_world); },
          "(3,): m, world.")
      .def_property_readonly(
          "position",
          [](const CollisionEvent& s) { return array_of(s.position_world); },
          "(3,): where it hit, m, world.");
  sample_class<VehicleEvent>(
      module,
      "VehicleEvent",
      "Something that happened on board: batteries, demands beyond limits, lost rotors.")
      .def_readonly(
          "kind",
          &VehicleEvent::kind,
          "off_track\", \"battery_low\", \"battery_empty\", \"rotor_lost\", \"beyond_limits\".")
      .def_readonly("words", &VehicleEvent::words, "One line.")
      .def_property_readonly(
          "position",
          [](const VehicleEvent& s) { return array_of(s.vehicle_world); },
          "(3,): of the vehicle, m, world.");
  sample_class<ObstacleSample>(
      module, "ObstacleSample", "Where all obstacles are, at output.obstacle_rate.")
      .def_property_readonly(
          "labels",
          [](const ObstacleSample& s) {
            std::vector<std::uint32_t> labels;
            for (const PlacedObstacle& o : s.obstacles) labels.push_back(o.label);
            const auto count = static_cast<py::ssize_t>(labels.size());
            return array_of(std::move(labels), {count});
          },
          "(n,): as in scans.")
      .def_property_readonly(
          "poses",
          [](const ObstacleSample& s) {
            const auto count = static_cast<py::ssize_t>(s.obstacles.size());
            py::array_t<double> poses({count, py::ssize_t{4}, py::ssize_t{4}});
            for (py::ssize_t i = 0; i < count; ++i) {
              const auto one = array_of(s.obstacles[static_cast<std::size_t>(i)].T_world_body);
              std::copy_n(one.data(), 16, poses.mutable_data() + 16 * i);
            }
            return poses;
          },
          "(n, 4, 4): T_world_obstacle.");
}

}  // namespace

py::object object_of(Sample&& sample) {
  return std::visit([](auto&& one) { return py::cast(std::move(one)); }, std::move(sample));
}

void add_samples(py::module_& module) {
  add_truth(module);
  add_measurements(module);
  add_scans(module);
  add_events(module);
}

}  // namespace pointflight::python
