// Many flights at once, for learning.
#include "pointflight/learn/flights.hpp"

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "pointflight/core/math.hpp"
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

  /// At positions (m, 3), heading for others (m, 3).
  void place(const Numbers& which, const Array<double>& positions, const Array<double>& facing) {
    const std::vector<std::uint32_t> numbers = numbers_of(which);
    const auto count = static_cast<py::ssize_t>(numbers.size());
    require_shape(positions, "positions", {count, 3});
    require_shape(facing, "facing", {count, 3});
    for (py::ssize_t k = 0; k < count; ++k) {
      const std::uint32_t i = numbers[static_cast<std::size_t>(k)];
      const Vector3d at(positions.at(k, 0), positions.at(k, 1), positions.at(k, 2));
      const double yaw = math::atan2(facing.at(k, 1) - at.y(), facing.at(k, 0) - at.x());
      if (!at.allFinite() || !std::isfinite(yaw)) {
        throw py::value_error("positions, facing: finite numbers are wanted");
      }
      flights_.place(i, at, yaw);
      write(i);
    }
  }

  void set_wind(const Numbers& which, const Array<double>& winds) {
    const std::vector<std::uint32_t> numbers = numbers_of(which);
    require_shape(winds, "winds", {static_cast<py::ssize_t>(numbers.size()), 3});
    for (std::size_t k = 0; k < numbers.size(); ++k) {
      const double* row = winds.data() + 3 * k;
      flights_.set_wind(numbers[k], {row[0], row[1], row[2]});
    }
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
                                            float range_max) {
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
  return std::make_shared<FlightsObject>(
      map,
      vehicle,
      count,
      options,
      RangePattern(std::move(beams), {shares.data(), shares.data() + shares.size()}, range_max));
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
           py::arg("range_max"))
      .def("place", &Object::place, py::arg("which"), py::arg("positions"), py::arg("facing"))
      .def("set_wind", &Object::set_wind, py::arg("which"), py::arg("winds"))
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
