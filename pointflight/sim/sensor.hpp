// What a vehicle measures with: a schedule and a measurement each.
#pragma once

#include <any>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pointflight/core/registry.hpp"
#include "pointflight/core/settings.hpp"
#include "pointflight/core/time.hpp"
#include "pointflight/sim/samples.hpp"

namespace pointflight {

class VehicleAgent;
struct VehicleStatus;

/// A schedule and a measurement: what an `InstantSensor` or an `IntervalSensor` is. Sensors do not
/// change in a run: what they remember is a value in their vehicle's status.
class Sensor {
 public:
  /// Hz; measurement k is at k / rate.
  explicit Sensor(double rate) : schedule_(rate) {}
  virtual ~Sensor() = default;
  Sensor(const Sensor&) = delete;
  Sensor& operator=(const Sensor&) = delete;

  /// When it measures, or starts to.
  [[nodiscard]] const Schedule& schedule() const { return schedule_; }

 private:
  Schedule schedule_;
};

/// What a sensor looks at when it measures.
struct InstantInput {
  std::int64_t index = 0;       ///< Number of the measurement since time zero.
  SimTime time;                 ///< Of the measurement, within the step under way.
  const VehicleState& state;    ///< Truth at `time`.
  const VehicleStatus& status;  ///< At the start of the step.
  const VehicleAgent& vehicle;  ///< What carries it.
};

/// Measures at instants.
class InstantSensor : public Sensor {
 public:
  using Sensor::Sensor;

  /// What it remembers from one measurement to the next, at the start: any value that is copied as
  /// a whole.
  [[nodiscard]] virtual std::any memory_at_start() const { return {}; }

  /// True if a measurement comes to nothing: it is not made.
  [[nodiscard]] virtual bool loses(std::int64_t /*index*/) const { return false; }

  /// One measurement; asked for each number once and in order, but for those that are lost. It may
  /// arrive later than it was made
  /// (`arrival_of`). Called from any thread, for one vehicle from one at a time.
  [[nodiscard]] virtual Sample measure(const InstantInput& input, std::any& memory) const = 0;

  /// It arrives now: what is only known then can be added.
  virtual void arrive(Sample& /*sample*/, const VehicleStatus& /*status*/) const {}
};

/// What a sensor looks at that measures for a while: in arrears, when all of it is known.
struct IntervalInput {
  std::int64_t index = 0;         ///< Number of the measurement since time zero.
  SimTime start;                  ///< It covers [start, end).
  SimTime end;                    ///< When the next one starts.
  const PoseTrack& T_world_body;  ///< Where its vehicle was meanwhile.
  std::span<const Body> bodies;   ///< What moved within its reach, but for its own vehicle.
  const Executor& executor;       ///< The result must not depend on its threads.
};

/// A measurement that takes time, under way: `job` is rendered, if it has one, then `finish`, once.
/// Called from any thread, one at a time.
class IntervalMeasurement {
 public:
  virtual ~IntervalMeasurement() = default;
  /// The beams to be rendered by the sensor's renderer; what the job refers to is valid as long as
  /// this is.
  [[nodiscard]] virtual std::optional<RenderJob> job() { return std::nullopt; }
  /// What was measured.
  [[nodiscard]] virtual Sample finish(const Executor& executor) = 0;
};

/// Measures from one instant of its schedule to the next: LiDARs, cameras. All that is due at an
/// instant is rendered together.
class IntervalSensor : public Sensor {
 public:
  using Sensor::Sensor;
  /// How far from the body's origin it can see anything, m.
  [[nodiscard]] virtual double reach() const = 0;
  /// True if the bodies of its input include the vehicle that carries it.
  [[nodiscard]] virtual bool sees_own_vehicle() const { return false; }
  /// True if a measurement comes to nothing: it is not made.
  [[nodiscard]] virtual bool loses(std::int64_t /*index*/) const { return false; }
  /// What renders its rays; null: it has none.
  [[nodiscard]] virtual const Renderer* renderer() const { return nullptr; }
  /// Begins a measurement; what the input refers to outlives it. Called from any thread.
  [[nodiscard]] virtual std::unique_ptr<IntervalMeasurement> begin(
      const IntervalInput& input) const = 0;
};

/// When a sample reaches the sinks.
[[nodiscard]] SimTime arrival_of(const Sample& sample);

/// A column of what a sensor measures.
struct SensorColumn {
  std::string name;  ///< Of the column in its file: "pressure".
  std::string unit;  ///< "Pa"; empty for numbers without one.
};

/// Where the world's origin lies on the earth: `origin` of a scenario. x is east, y north.
struct EarthOrigin {
  double latitude = 50.0;     ///< deg, WGS 84
  double longitude = 8.0;     ///< deg, WGS 84
  double altitude = 0.0;      ///< Of z = 0 above sea level, m: what barometers go by.
  double geoid_height = 0.0;  ///< Of sea level there above the ellipsoid, m: GNSS measures from it.
};
/// Its keys.
void describe(SettingsVisitor& visitor, EarthOrigin& origin);

/// Who a new sensor belongs to.
struct SensorSite {
  std::uint32_t vehicle = 0;  ///< Number in the fleet: the entity of its random streams.
  std::uint32_t sensor = 0;   ///< Number on the vehicle, as in `Measurement`.
  std::uint64_t seed = 0;     ///< Of its random draws.
  EarthOrigin origin{};       ///< Of the world that it is in.
};

/// A kind of sensor that scenarios can mount (`sensors: [{kind: NAME, ...}]`): a row of
/// `sensor_kinds`. What it measures are `Measurement`s; the recorder writes `<name>.csv` of them.
struct SensorKind {
  std::string name;                   ///< In scenarios and of its file.
  std::string help;                   ///< Half a sentence.
  std::vector<SensorColumn> columns;  ///< Of `Measurement::values`.
  std::any settings;                  ///< With their defaults.
  /// The keys of its settings, as `describe` of any settings.
  std::function<void(SettingsVisitor&, std::any&)> describe;
  /// One of its settings. May throw InputError.
  std::function<std::unique_ptr<Sensor>(const SensorSite&, const std::any&)> make;
};

/// A row for a class `S`, made of (SensorSite, Settings), and its settings, which have a
/// `describe(SettingsVisitor&, Settings&)`.
template <class S, class Settings>
SensorKind sensor_kind(std::string name, std::string help, std::vector<SensorColumn> columns) {
  SensorKind kind;
  kind.name = std::move(name);
  kind.help = std::move(help);
  kind.columns = std::move(columns);
  kind.settings = Settings{};
  kind.describe = [](SettingsVisitor& visitor, std::any& settings) {
    describe(visitor, std::any_cast<Settings&>(settings));
  };
  kind.make = [](const SensorSite& site, const std::any& settings) {
    return std::make_unique<S>(site, std::any_cast<const Settings&>(settings));
  };
  return kind;
}

/// The kinds that scenarios can mount besides LiDARs, odometry and IMU, which every vehicle has:
/// barometer, magnetometer, gnss, range_finder (`sim/navigation_sensors`), and those that programs
/// add.
Registry<SensorKind>& sensor_kinds();

/// One entry of a scenario's `sensors`.
struct SensorSetup {
  const SensorKind* kind = nullptr;  ///< Never null once it is read.
  std::any settings;                 ///< The kind's; empty: its defaults.
};

/// The keys of an entry.
void describe(SettingsVisitor& visitor, SensorSetup& setup);

}  // namespace pointflight
