// Many flights at once, for learning.
#include "pointflight/learn/flights.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "pointflight/core/math.hpp"
#include "pointflight/sim/scenario.hpp"
#include "python/bindings/arrays.hpp"
#include "python/bindings/map_object.hpp"
#include "python/bindings/run_objects.hpp"
#include "python/bindings/work.hpp"

namespace pointflight::python {
namespace {

/// Columns of the table of states.
enum Column : std::size_t {
  kPositionColumn = 0,     // 3, m
  kVelocityColumn = 3,     // 3, m/s, world
  kOrientationColumn = 6,  // 4: x y z w
  kRatesColumn = 10,       // 3, rad/s, body
  kHeadingColumn = 13,     // 2: cosine and sine
  kClearanceColumn = 15,
  kFlownColumn = 16,
  kCollidedColumn = 17,
  kColumns = 18
};

using Numbers = Array<std::uint32_t>;

constexpr py::ssize_t kStartColumns = 11;  // of what `place` is given
constexpr std::size_t kSlices = 1000;      // 200 s of the obstacles' clock

/// Flights with the arrays that Python sees.
class FlightsObject {
 public:
  FlightsObject(const MapObject& map,
                const VehicleSettings& vehicle,
                std::size_t count,
                const FlightsOptions& options,
                RangePattern pattern)
      : flights_(map.map, vehicle, count, options, std::move(pattern)),
        by_rotor_(options.level == FlightLevel::kRotorSpeeds),
        table_(count * kColumns),
        ranges_(count * flights_.beams(), 1.0f) {
    for (std::size_t i = 0; i < count; ++i) write(i);
  }

  [[nodiscard]] std::size_t size() const { return flights_.size(); }

  /// Starts: rows of position (3), what it heads for (3), mean wind (3), share of the load, time.
  void place(const Numbers& which, const Array<double>& starts, const Array<std::uint64_t>& seeds) {
    const std::vector<std::uint32_t> numbers = numbers_of(which);
    const auto count = static_cast<py::ssize_t>(numbers.size());
    require_shape(starts, "starts", {count, kStartColumns});
    require_shape(seeds, "seeds", {count});
    for (py::ssize_t k = 0; k < count; ++k) {
      const double* row = starts.data() + k * kStartColumns;
      if (!std::all_of(row, row + kStartColumns, [](double v) { return std::abs(v) < 1e8; }) ||
          row[9] <= 0.0) {
        throw py::value_error("starts: finite numbers are wanted, and loads above 0");
      }
      FlightStart start;
      start.p_world = {row[0], row[1], row[2]};
      start.yaw = math::atan2(row[4] - row[1], row[3] - row[0]);
      start.wind_world = {row[6], row[7], row[8]};
      start.load_share = row[9];
      start.time = SimTime{} + from_seconds(row[10]);
      start.seed = seeds.at(k);
      const std::uint32_t i = numbers[static_cast<std::size_t>(k)];
      flights_.place(i, start);
      write(i);
    }
  }

  /// A share for each of these vehicles.
  void set_rotor(const Numbers& which, std::size_t rotor, const Array<double>& shares) {
    const std::vector<std::uint32_t> numbers = numbers_of(which);
    require_shape(shares, "shares", {static_cast<py::ssize_t>(numbers.size())});
    for (std::size_t k = 0; k < numbers.size(); ++k) {
      flights_.set_rotor(numbers[k], rotor, shares.data()[k]);
    }
  }

  /// (m,) of positions (m, 3) at times (m,).
  [[nodiscard]] py::array_t<double> clearance_of_obstacles(const Array<double>& positions,
                                                           const Array<double>& times) const {
    require_shape(positions, "positions", {-1, 3});
    require_shape(times, "times", {positions.shape(0)});
    std::vector<double> found;
    for (py::ssize_t k = 0; k < positions.shape(0); ++k) {
      const Vector3d at(positions.at(k, 0), positions.at(k, 1), positions.at(k, 2));
      if (!at.allFinite() || !(std::abs(times.at(k)) < 1e8)) {
        throw py::value_error("positions, times: finite numbers are wanted");
      }
      found.push_back(flights_.clearance_of_obstacles(at, SimTime{} + from_seconds(times.at(k))));
    }
    return array_of(std::move(found), {positions.shape(0)});
  }

  void step(const Array<double>& actions, const Array<std::uint8_t>& moves) {
    const std::size_t numbers = by_rotor_ ? flights_.vehicle().rotors.size() : 4;
    require_shape(
        actions, "actions", {static_cast<py::ssize_t>(size()), static_cast<py::ssize_t>(numbers)});
    require_shape(moves, "moves", {static_cast<py::ssize_t>(size())});
    const std::span asked(actions.data(), size() * numbers);
    const std::span moving(moves.data(), size());
    const py::gil_scoped_release unlocked;
    const auto threads = executor();
    flights_.step(asked, moving, *threads);
    for (std::size_t i = 0; i < size(); ++i) write(i);
  }

  void measure(const Numbers& which) {
    const std::vector<std::uint32_t> numbers = numbers_of(which);
    const py::gil_scoped_release unlocked;
    flights_.measure(numbers, ranges_, *executor());
  }

  [[nodiscard]] py::array_t<double> free_positions(const Array<double>& box,
                                                   double clearance,
                                                   double low,
                                                   double high,
                                                   std::size_t wanted,
                                                   std::uint64_t seed) const {
    require_shape(box, "box", {2, 3});
    Aabb bounds;
    bounds.add({box.at(0, 0), box.at(0, 1), box.at(0, 2)});
    bounds.add({box.at(1, 0), box.at(1, 1), box.at(1, 2)});
    std::vector<Vector3d> found;
    {
      const py::gil_scoped_release unlocked;
      found = flights_.free_positions(bounds, clearance, {low, high}, wanted, seed);
    }
    std::vector<double> rows;
    for (const Vector3d& p : found) rows.insert(rows.end(), {p.x(), p.y(), p.z()});
    const auto count = static_cast<py::ssize_t>(found.size());
    return array_of(std::move(rows), {count, 3});
  }

  [[nodiscard]] const std::vector<double>& table() const { return table_; }
  [[nodiscard]] const std::vector<float>& ranges() const { return ranges_; }
  [[nodiscard]] std::size_t beams() const { return flights_.beams(); }

 private:
  [[nodiscard]] std::vector<std::uint32_t> numbers_of(const Numbers& which) const {
    require_shape(which, "numbers", {-1});
    std::vector<std::uint32_t> numbers(which.data(), which.data() + which.size());
    for (const std::uint32_t i : numbers) {
      if (i >= size())
        throw py::index_error("a vehicle " + std::to_string(i) + ": there are fewer");
    }
    return numbers;
  }

  void write(std::size_t i) {
    const RigidBodyState body = flights_.body(i);
    const Flights::Status& status = flights_.status(i);
    const auto heading = math::sincos(flights_.yaw(i));
    double* row = &table_[i * kColumns];
    for (int k = 0; k < 3; ++k) {
      row[kPositionColumn + static_cast<std::size_t>(k)] = body.p_world[k];
      row[kVelocityColumn + static_cast<std::size_t>(k)] = body.v_world[k];
      row[kRatesColumn + static_cast<std::size_t>(k)] = body.omega_body[k];
    }
    for (int k = 0; k < 4; ++k) {
      row[kOrientationColumn + static_cast<std::size_t>(k)] = body.q_world_body.coeffs()[k];
    }
    row[kHeadingColumn] = heading.cos;
    row[kHeadingColumn + 1] = heading.sin;
    row[kClearanceColumn] = status.clearance;
    row[kFlownColumn] = status.flown;
    row[kCollidedColumn] = status.collided ? 1.0 : 0.0;
  }

  Flights flights_;
  bool by_rotor_;
  std::vector<double> table_;
  std::vector<float> ranges_;
};

FlightLevel level_of(const std::string& name) {
  if (name == "velocity") return FlightLevel::kVelocity;
  if (name == "acceleration") return FlightLevel::kAcceleration;
  if (name == "body_rates") return FlightLevel::kBodyRates;
  if (name == "rotor_speeds") return FlightLevel::kRotorSpeeds;
  throw py::value_error("action: velocity, acceleration, body_rates or rotor_speeds, not " + name);
}

std::shared_ptr<const Obstacles> obstacles_of(const Scenario& scenario,
                                              const std::shared_ptr<const SurfelMap>& map) {
  if (scenario.obstacles.empty()) return nullptr;
  return std::make_shared<const Obstacles>(
      scenario.obstacles, scenario.obstacle_world(map), *executor(), kSlices);
}

/// What a sensor reports in a map.
std::shared_ptr<const ReturnModel> returns_of(const std::string& sensor,
                                              const SurfelMap& map,
                                              const Scenario& scenario) {
  const LidarSettings settings = load_lidar(sensor);
  if (settings.measures_depth()) {
    throw py::value_error("sensor: " + sensor + " is a depth camera; a LiDAR is wanted");
  }
  return std::make_shared<const ReturnModel>(settings, surroundings_in(map, scenario.surroundings));
}

std::shared_ptr<FlightsObject> make_flights(const MapObject& map,
                                            const VehicleSettings& vehicle,
                                            std::size_t count,
                                            const std::string& level,
                                            double action_period,
                                            double physics_step,
                                            int steps_per_control,
                                            double speed_max,
                                            const Array<float>& directions,
                                            const Array<float>& shares,
                                            float range_max,
                                            std::size_t pooled,
                                            const std::string& sensor,
                                            const Scenario& scenario,
                                            std::size_t team,
                                            const std::string& renderer) {
  if (count < 1 || count > 1'000'000) throw py::value_error("count: 1 to 1000000");
  require_shape(directions, "directions", {-1, 3});
  require_shape(shares, "shares", {-1});
  std::vector<Vector3f> beams;
  for (py::ssize_t i = 0; i < directions.shape(0); ++i) {
    beams.emplace_back(directions.at(i, 0), directions.at(i, 1), directions.at(i, 2));
  }
  FlightsOptions options;
  options.level = level_of(level);
  options.action_period = action_period;
  options.timing.physics_step = physics_step;
  options.timing.steps_per_control = steps_per_control;
  options.speed_max = speed_max;
  options.team = team;
  options.renderer = renderer;
  options.wind = scenario.air.wind;
  options.obstacles = obstacles_of(scenario, map.map);
  for (const ObstacleSettings& settings : scenario.obstacles) {
    options.obstacle_speed = std::max({options.obstacle_speed, settings.speed, settings.speed_max});
  }
  RangePattern pattern(
      std::move(beams), {shares.data(), shares.data() + shares.size()}, range_max, pooled);
  if (!sensor.empty()) pattern.report_by(returns_of(sensor, *map.map, scenario));
  return std::make_shared<FlightsObject>(map, vehicle, count, options, std::move(pattern));
}

}  // namespace

void add_flights(py::module_& module) {
  using Object = FlightsObject;
  py::class_<Object, std::shared_ptr<Object>>(module, "_Flights")
      .def(py::init(&make_flights),
           py::arg("map"),
           py::arg("vehicle"),
           py::arg("count"),
           py::arg("level"),
           py::arg("action_period"),
           py::arg("physics_step"),
           py::arg("steps_per_control"),
           py::arg("speed_max"),
           py::arg("directions"),
           py::arg("shares"),
           py::arg("range_max"),
           py::arg("pooled"),
           py::arg("sensor"),
           py::arg("scenario"),
           py::arg("team"),
           py::arg("renderer"))
      .def("place", &Object::place, py::arg("which"), py::arg("starts"), py::arg("seeds"))
      .def("set_rotor", &Object::set_rotor, py::arg("which"), py::arg("rotor"), py::arg("shares"))
      .def("clearance_of_obstacles",
           &Object::clearance_of_obstacles,
           py::arg("positions"),
           py::arg("times"))
      .def("step", &Object::step, py::arg("actions"), py::arg("moves"))
      .def("measure", &Object::measure, py::arg("which"))
      .def("free_positions",
           &Object::free_positions,
           py::arg("box"),
           py::arg("clearance"),
           py::arg("low"),
           py::arg("high"),
           py::arg("wanted"),
           py::arg("seed"))
      .def_property_readonly("table",
                             [](const py::object& self) {
                               const auto& o = self.cast<const Object&>();
                               const auto all = view_of(std::span<const double>(o.table()), self);
                               return all.attr("reshape")(o.size(), std::size_t{kColumns});
                             })
      .def_property_readonly("ranges", [](const py::object& self) {
        const auto& o = self.cast<const Object&>();
        const auto all = view_of(std::span<const float>(o.ranges()), self);
        return all.attr("reshape")(o.size(), o.beams());
      });
}

}  // namespace pointflight::python
