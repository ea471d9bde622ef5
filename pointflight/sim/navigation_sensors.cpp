#include "pointflight/sim/navigation_sensors.hpp"

#include <algorithm>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/sim/vehicle_agent.hpp"

namespace pointflight {
namespace {

constexpr std::uint64_t kDraws = 12;             // of two numbers each, for a measurement
constexpr std::uint64_t kOfTheRun = 1ull << 60;  // index of what holds for a whole run
constexpr double kSemiMajor = 6378137.0;         // m, WGS 84
constexpr double kFlattening = 1.0 / 298.257223563;

/// Random draws of one sensor.
class Draws {
 public:
  explicit Draws(const SensorSite& site)
      : random_(site.seed, StreamId::kNavigation, site.vehicle << 8 | site.sensor) {}
  [[nodiscard]] double normal(std::int64_t index, std::uint64_t draw) const {
    return random_.normal(kDraws * static_cast<std::uint64_t>(index) + draw);
  }
  [[nodiscard]] Vector3d normals(std::int64_t index, std::uint64_t draw) const {
    return {normal(index, draw), normal(index, draw + 1), normal(index, draw + 2)};
  }
  [[nodiscard]] Vector3d of_run(std::uint64_t draw) const {
    return {random_.normal(kOfTheRun + 3 * draw),
            random_.normal(kOfTheRun + 3 * draw + 1),
            random_.normal(kOfTheRun + 3 * draw + 2)};
  }

 private:
  RandomStream random_;
};

class Barometer : public InstantSensor {
 public:
  Barometer(const SensorSite& site, const BarometerSettings& settings)
      : InstantSensor(settings.rate), site_(site), settings_(settings), draws_(site) {}
  [[nodiscard]] std::any memory_at_start() const override { return 0.0; }
  [[nodiscard]] Sample measure(const InstantInput& input, std::any& memory) const override {
    auto& drift = *std::any_cast<double>(&memory);
    drift += settings_.drift / std::sqrt(settings_.rate) * draws_.normal(input.index, 0);
    const double altitude = site_.origin.altitude + input.state.body.p_world.z();
    const double pressure = standard_pressure(altitude, settings_.sea_pressure) +
                            settings_.offset * draws_.of_run(0).x() + drift +
                            settings_.noise * draws_.normal(input.index, 1);
    return Measurement{site_.vehicle, site_.sensor, input.time, input.time, {pressure}};
  }

 private:
  SensorSite site_;
  BarometerSettings settings_;
  Draws draws_;
};

class Magnetometer : public InstantSensor {
 public:
  Magnetometer(const SensorSite& site, const MagnetometerSettings& settings)
      : InstantSensor(settings.rate), site_(site), settings_(settings), draws_(site) {
    const auto down = math::sincos(settings.inclination_deg * kDegree);
    const auto east = math::sincos(settings.declination_deg * kDegree);
    field_world_ = settings.field * Vector3d(down.cos * east.sin, down.cos * east.cos, -down.sin);
  }
  [[nodiscard]] Sample measure(const InstantInput& input, std::any& /*memory*/) const override {
    const Vector3d truth = input.state.body.q_world_body.conjugate() * field_world_;
    const Vector3d scales = Vector3d::Ones() + settings_.scale_error * draws_.of_run(0);
    const Vector3d seen = scales.cwiseProduct(truth) + settings_.hard_iron * draws_.of_run(1) +
                          settings_.noise * draws_.normals(input.index, 0);
    return Measurement{
        site_.vehicle, site_.sensor, input.time, input.time, {seen.x(), seen.y(), seen.z()}};
  }

 private:
  SensorSite site_;
  MagnetometerSettings settings_;
  Draws draws_;
  Vector3d field_world_;
};

/// The slow error is a first-order Gauss-Markov process, begun at its steady deviation.
class Gnss : public InstantSensor {
 public:
  Gnss(const SensorSite& site, const GnssSettings& settings)
      : InstantSensor(settings.rate), site_(site), settings_(settings), draws_(site) {}
  [[nodiscard]] std::any memory_at_start() const override { return Memory{}; }
  [[nodiscard]] bool loses(std::int64_t index) const override {
    const double t = to_seconds(schedule().at(index).time_since_epoch());
    return std::any_of(settings_.outages.begin(),
                       settings_.outages.end(),
                       [t](const Outage& outage) { return t >= outage.from && t < outage.until; });
  }
  [[nodiscard]] Sample measure(const InstantInput& input, std::any& memory) const override {
    const GnssSettings& s = settings_;
    auto& [index, slow] = *std::any_cast<Memory>(&memory);
    const Vector3d deviation(s.horizontal, s.horizontal, s.vertical);
    const double gap = static_cast<double>(input.index - index) / s.rate;
    const double keep = index < 0 ? 0.0 : math::exp(-gap / s.correlation);
    slow = keep * slow +
           std::sqrt(1.0 - keep * keep) * deviation.cwiseProduct(draws_.normals(input.index, 0));
    index = input.index;
    const RigidBodyState& body = input.state.body;
    const Vector3d seen = body.p_world + slow + s.noise * draws_.normals(input.index, 3);
    const Vector3d v = body.v_world + s.velocity_noise * draws_.normals(input.index, 6);
    const EarthOrigin& o = site_.origin;
    const GeodeticPosition place =
        geodetic({o.latitude, o.longitude, o.altitude + o.geoid_height}, seen);
    const double horizontal = std::sqrt(s.horizontal * s.horizontal + s.noise * s.noise);
    const double vertical = std::sqrt(s.vertical * s.vertical + s.noise * s.noise);
    return Measurement{site_.vehicle,
                       site_.sensor,
                       input.time,
                       input.time + from_seconds(s.latency),
                       {place.latitude,
                        place.longitude,
                        place.altitude,
                        v.x(),
                        v.y(),
                        v.z(),
                        horizontal,
                        vertical}};
  }

 private:
  struct Memory {
    std::int64_t index = -1;
    Vector3d slow = Vector3d::Zero();
  };
  SensorSite site_;
  GnssSettings settings_;
  Draws draws_;
};

class RangeFinder : public InstantSensor {
 public:
  RangeFinder(const SensorSite& site, const RangeFinderSettings& settings)
      : InstantSensor(settings.rate), site_(site), settings_(settings), draws_(site) {
    const Vector3d rpy = settings.rotation_rpy_deg * kDegree;
    T_body_sensor_ = {quaternion_from_rpy(rpy.x(), rpy.y(), rpy.z()), settings.position};
  }
  [[nodiscard]] Sample measure(const InstantInput& input, std::any& /*memory*/) const override {
    const RangeFinderSettings& s = settings_;
    const Pose T_world_sensor = input.state.body.T_world_body() * T_body_sensor_;
    Ray ray;
    ray.origin_world = T_world_sensor.translation;
    ray.direction_world = (T_world_sensor.rotation * Vector3d::UnitX()).cast<float>();
    ray.range_max = static_cast<float>(s.range_max);
    const Hit hit = input.vehicle.look(ray);
    double range = kNothing;
    if (hit.is_return()) {
      const auto truth = static_cast<double>(hit.range);
      range = truth + std::max(s.noise, s.noise_share * truth) * draws_.normal(input.index, 0);
      if (range < s.range_min || range > s.range_max) range = kNothing;
    }
    return Measurement{
        site_.vehicle, site_.sensor, input.time, input.time, {range, s.range_min, s.range_max}};
  }

 private:
  static constexpr double kNothing = -1.0;
  SensorSite site_;
  RangeFinderSettings settings_;
  Draws draws_;
  Pose T_body_sensor_;
};

}  // namespace

double standard_pressure(double altitude, double sea_pressure) {
  return sea_pressure * math::pow(std::max(0.0, 1.0 - 2.25577e-5 * altitude), 5.25588);
}

GeodeticPosition geodetic(const GeodeticPosition& origin, const Vector3d& p_world) {
  const auto latitude = math::sincos(origin.latitude * kDegree);
  const double e2 = kFlattening * (2.0 - kFlattening);
  const double w2 = 1.0 - e2 * latitude.sin * latitude.sin;
  const double east = kSemiMajor / std::sqrt(w2);  // prime vertical
  const double north = east * (1.0 - e2) / w2;     // meridian
  const double height = origin.altitude + p_world.z();
  return {origin.latitude + p_world.y() / (north + height) / kDegree,
          origin.longitude + p_world.x() / ((east + height) * latitude.cos) / kDegree,
          height};
}

void describe(SettingsVisitor& v, EarthOrigin& s) {
  v.value({"latitude", "deg", "WGS 84", -89, 89}, s.latitude);
  v.value({"longitude", "deg", "WGS 84", -180, 180}, s.longitude);
  v.value({"altitude", "m", "of z = 0 above sea level", -500, 10000}, s.altitude);
  v.value({"geoid_height", "m", "of sea level there above the ellipsoid", -120, 120},
          s.geoid_height);
}

void describe(SettingsVisitor& v, BarometerSettings& s) {
  v.value({"rate", "Hz", "of measurements", 0.1, 1000}, s.rate);
  v.value({"noise", "Pa", "white", 0, 1000}, s.noise);
  v.value({"offset", "Pa", "deviation from run to run", 0, 10000}, s.offset);
  v.value({"drift", "Pa/sqrt(s)", "random walk", 0, 100}, s.drift);
  v.value({"sea_pressure", "Pa", "at sea level", 5e4, 2e5}, s.sea_pressure);
}

void describe(SettingsVisitor& v, MagnetometerSettings& s) {
  v.value({"rate", "Hz", "of measurements", 0.1, 1000}, s.rate);
  v.value({"noise", "uT", "white, of each axis", 0, 100}, s.noise);
  v.value({"hard_iron", "uT", "deviation of each axis' offset from run to run", 0, 1000},
          s.hard_iron);
  v.value({"scale_error", "", "deviation of each axis' scale from run to run", 0, 0.5},
          s.scale_error);
  v.value({"field", "uT", "of the earth", 0, 100}, s.field);
  v.value({"inclination_deg", "deg", "below the horizon", -90, 90}, s.inclination_deg);
  v.value({"declination_deg", "deg", "of magnetic north, from world y to x", -180, 180},
          s.declination_deg);
}

void describe(SettingsVisitor& v, GnssSettings& s) {
  v.value({"rate", "Hz", "of fixes", 0.1, 100}, s.rate);
  v.value({"horizontal", "m", "deviation of the slow error, east and north", 0, 1000},
          s.horizontal);
  v.value({"vertical", "m", "the same, up", 0, 1000}, s.vertical);
  v.value({"correlation", "s", "time constant of the slow error", 0.1, 1e5}, s.correlation);
  v.value({"noise", "m", "white, of each coordinate", 0, 100}, s.noise);
  v.value({"velocity_noise", "m/s", "white, of each component", 0, 100}, s.velocity_noise);
  v.value({"latency", "s", "until a fix arrives", 0, 10}, s.latency);
  v.list({"outages", "", "no fixes then"}, s.outages, [](SettingsVisitor& w, Outage& outage) {
    w.value({"from", "s", "when it starts", 0, 1e6}, outage.from);
    w.value({"until", "s", "when it ends", 0, 1e6}, outage.until);
    w.require("until", outage.until > outage.from, "is not after from");
  });
}

void describe(SettingsVisitor& v, RangeFinderSettings& s) {
  v.value({"rate", "Hz", "of measurements", 0.1, 1000}, s.rate);
  v.value({"range_min", "m", "nothing nearer is seen", 0, 1000}, s.range_min);
  v.value({"range_max", "m", "nothing farther is seen", 0.01, 1e4}, s.range_max);
  v.require("range_max", s.range_max > s.range_min, "is not above range_min");
  v.value({"noise", "m", "deviation", 0, 10}, s.noise);
  v.value({"noise_share", "", "or this share of the range, if that is more", 0, 1}, s.noise_share);
  v.value({"position", "m", "in the body frame", -100, 100}, s.position);
  v.value(
      {"rotation_rpy_deg", "deg", "roll, pitch, yaw of its axes; it looks along its x", -360, 360},
      s.rotation_rpy_deg);
}

void add_navigation_sensors(Registry<SensorKind>& kinds) {
  kinds.add(sensor_kind<Barometer, BarometerSettings>(
      "barometer", "static pressure", {{"pressure", "Pa"}}));
  kinds.add(sensor_kind<Magnetometer, MagnetometerSettings>(
      "magnetometer",
      "the earth's field in body axes",
      {{"field_x", "uT"}, {"field_y", "uT"}, {"field_z", "uT"}}));
  kinds.add(sensor_kind<Gnss, GnssSettings>("gnss",
                                            "satellite fixes",
                                            {{"latitude", "deg"},
                                             {"longitude", "deg"},
                                             {"altitude", "m"},
                                             {"v_east", "m/s"},
                                             {"v_north", "m/s"},
                                             {"v_up", "m/s"},
                                             {"horizontal_deviation", "m"},
                                             {"vertical_deviation", "m"}}));
  kinds.add(sensor_kind<RangeFinder, RangeFinderSettings>(
      "range_finder",
      "distance to the map along one ray; -1: nothing",
      {{"range", "m"}, {"range_min", "m"}, {"range_max", "m"}}));
}

}  // namespace pointflight
