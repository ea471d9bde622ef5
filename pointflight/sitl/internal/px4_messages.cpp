#include "pointflight/sitl/internal/px4_messages.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/geometry/frames.hpp"
#include "pointflight/geometry/rotation.hpp"

namespace pointflight {
namespace {

using mavlink::HilSensor;

constexpr double kGaussPerMicrotesla = 0.01;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// Rounded and cut to what the type holds.
template <class Integer>
Integer whole(double value) {
  constexpr double kLow = static_cast<double>(std::numeric_limits<Integer>::lowest());
  constexpr double kHigh = static_cast<double>(std::numeric_limits<Integer>::max());
  return static_cast<Integer>(std::lround(std::clamp(value, kLow, kHigh)));
}

std::array<std::int16_t, 3> centimetres(const Vector3d& v) {
  return {whole<std::int16_t>(100.0 * v.x()),
          whole<std::int16_t>(100.0 * v.y()),
          whole<std::int16_t>(100.0 * v.z())};
}

/// Course over ground, 0.01 degrees.
std::uint16_t course_of(const Vector3d& v_ned) {
  double degrees = math::atan2(v_ned.y(), v_ned.x()) / kDegree;
  if (degrees < 0.0) degrees += 360.0;
  return whole<std::uint16_t>(std::min(100.0 * degrees, 35999.0));
}

/// MAV_SENSOR_ORIENTATION of a direction in the body (front, left, up) within 10 degrees.
std::uint8_t orientation_of(const Vector3d& direction) {
  struct Row {
    std::uint8_t number;
    Vector3d direction;
  };
  const Row rows[] = {{0, {1, 0, 0}},
                      {2, {0, -1, 0}},
                      {4, {-1, 0, 0}},
                      {6, {0, 1, 0}},
                      {24, {0, 0, 1}},
                      {25, {0, 0, -1}}};
  constexpr double kNear = 0.985;
  for (const Row& row : rows) {
    if (direction.dot(row.direction) > kNear) return row.number;
  }
  return mavlink::DistanceSensor::kCustomOrientation;
}

/// Temperature and altitude of a pressure (Pa) in the standard atmosphere (ISO 2533).
struct Air {
  double altitude;     ///< m
  double temperature;  ///< deg C
};
Air standard_air(double pressure) {
  constexpr double kSea = 101325.0;
  const double altitude = (1.0 - math::pow(pressure / kSea, 1.0 / 5.25588)) / 2.25577e-5;
  return {altitude, 15.0 - 0.0065 * altitude};
}

}  // namespace

void put_pressure(const std::vector<double>& v, HilSensor& sensor) {
  const Air air = standard_air(v[0]);
  sensor.pressure = static_cast<float>(0.01 * v[0]);
  sensor.pressure_altitude = static_cast<float>(air.altitude);
  sensor.temperature = static_cast<float>(air.temperature);
  sensor.updated |= HilSensor::kBarometer;
}

void put_field(const std::vector<double>& v, HilSensor& sensor) {
  sensor.field = floats(kGaussPerMicrotesla * frd_from_flu({v[0], v[1], v[2]}));
  sensor.updated |= HilSensor::kMagnetometer;
}

mavlink::HilGps gps_of(const std::vector<double>& v,
                       const EarthOrigin& origin,
                       std::uint64_t time_usec) {
  const Vector3d velocity = ned_from_enu({v[3], v[4], v[5]});
  mavlink::HilGps gps;
  gps.time_usec = time_usec;
  gps.latitude = whole<std::int32_t>(1e7 * v[0]);
  gps.longitude = whole<std::int32_t>(1e7 * v[1]);
  gps.altitude = whole<std::int32_t>(1e3 * (v[2] - origin.geoid_height));
  gps.horizontal = whole<std::uint16_t>(100.0 * v[6]);
  gps.vertical = whole<std::uint16_t>(100.0 * v[7]);
  gps.speed = whole<std::uint16_t>(100.0 * velocity.head<2>().norm());
  gps.velocity = centimetres(velocity);
  gps.course = course_of(velocity);
  gps.fix = 3;
  gps.satellites = 12;
  return gps;
}

mavlink::DistanceSensor distance_of(const std::vector<double>& v,
                                    const RangeFinderSettings& mount,
                                    std::uint64_t time_usec) {
  const Vector3d rpy = mount.rotation_rpy_deg * kDegree;
  const Quaterniond q_body_sensor = quaternion_from_rpy(rpy.x(), rpy.y(), rpy.z());
  mavlink::DistanceSensor distance;
  distance.time_boot_ms = static_cast<std::uint32_t>(time_usec / 1000);
  distance.least = whole<std::uint16_t>(100.0 * v[1]);
  distance.most = whole<std::uint16_t>(100.0 * v[2]);
  // nothing seen: beyond the greatest
  distance.current = v[0] >= 0.0 ? whole<std::uint16_t>(100.0 * v[0])
                                 : static_cast<std::uint16_t>(std::min(distance.most + 1, 65535));
  distance.orientation = orientation_of(q_body_sensor * Vector3d::UnitX());
  const Quaterniond flip(0.0, 1.0, 0.0, 0.0);
  distance.q = floats(flip * q_body_sensor * flip.conjugate());
  distance.quality = v[0] >= 0.0 ? 100 : 1;
  return distance;
}

mavlink::HilStateQuaternion truth_of(const RigidBodyState& body,
                                     const Vector3d& a_world,
                                     const EarthOrigin& origin,
                                     std::uint64_t time_usec) {
  const GeodeticPosition place =
      geodetic({origin.latitude, origin.longitude, origin.altitude}, body.p_world);
  const Vector3d velocity = ned_from_enu(body.v_world);
  const Vector3d acceleration = ned_from_enu(a_world);
  mavlink::HilStateQuaternion truth;
  truth.time_usec = time_usec;
  truth.q = floats(q_ned_frd(body.q_world_body));
  truth.rates = floats(frd_from_flu(body.omega_body));
  truth.latitude = whole<std::int32_t>(1e7 * place.latitude);
  truth.longitude = whole<std::int32_t>(1e7 * place.longitude);
  truth.altitude = whole<std::int32_t>(1e3 * place.altitude);
  truth.velocity = centimetres(velocity);
  truth.true_airspeed = whole<std::uint16_t>(100.0 * velocity.norm());
  for (int axis = 0; axis < 3; ++axis) {
    truth.acceleration[static_cast<std::size_t>(axis)] =
        whole<std::int16_t>(1e3 * acceleration[axis]);
  }
  return truth;
}

mavlink::Odometry vision_of(const OdometrySample& sample, std::uint64_t time_usec) {
  const RigidBodyState& body = sample.state;
  mavlink::Odometry vision;
  vision.time_usec = time_usec;
  vision.position = floats(ned_from_enu(body.p_world));
  vision.q = floats(q_ned_frd(body.q_world_body));
  vision.velocity = floats(frd_from_flu(body.q_world_body.conjugate() * body.v_world));
  vision.rates = floats(frd_from_flu(body.omega_body));
  vision.pose_covariance.fill(0.0f);
  vision.velocity_covariance.fill(0.0f);
  // the diagonal of an upper right triangle of six rows
  constexpr std::size_t kDiagonal[] = {0, 6, 11, 15, 18, 20};
  const EstimateVariance& of = sample.variance;
  const double pose[] = {of.position, of.position, of.position, of.tilt, of.tilt, of.yaw};
  for (std::size_t i = 0; i < 6; ++i) {
    vision.pose_covariance[kDiagonal[i]] = static_cast<float>(pose[i]);
    vision.velocity_covariance[kDiagonal[i]] = i < 3 ? static_cast<float>(of.velocity) : kNaN;
  }
  return vision;
}

mavlink::ObstacleDistance obstacles_of(const ScanSample& sample,
                                       const Pose& T_body_lidar,
                                       double band,
                                       std::uint64_t time_usec) {
  const Scan& scan = *sample.scan;
  constexpr double kMost = 65.0;  // m
  mavlink::ObstacleDistance message;
  const std::size_t count = message.distances.size();
  const double step = 2.0 * kPi / static_cast<double>(count);
  message.time_usec = time_usec;
  message.least = 20;
  message.most = static_cast<std::uint16_t>(100.0 * kMost);
  message.increment = static_cast<std::uint8_t>(std::lround(step / kDegree));
  message.distances.fill(65535);
  const Pose T_world_body = sample.T_world_sensor.at(scan.end) * T_body_lidar.inverse();
  const double yaw = yaw_of(T_world_body.rotation);
  const Quaterniond q_level_world = quaternion_from_rpy(0.0, 0.0, -yaw);
  for (const ScanPoint& point : scan.points) {
    const Vector3d p_world =
        sample.T_world_sensor.at(scan.seen_at(point)) * point.position_sensor.cast<double>();
    const Vector3d p = q_level_world * (p_world - T_world_body.translation);
    const double away = p.head<2>().norm();
    if (away < 0.01) continue;
    double bearing = -math::atan2(p.y(), p.x()) / step;  // clockwise
    if (bearing < -0.5) bearing += static_cast<double>(count);
    const auto at = static_cast<std::size_t>(std::lround(bearing)) % count;
    std::uint16_t& distance = message.distances[at];
    if (distance == 65535) distance = static_cast<std::uint16_t>(message.most + 1);
    if (std::abs(p.z()) > band || away > kMost) continue;
    distance = std::min(distance, whole<std::uint16_t>(100.0 * away));
  }
  return message;
}

}  // namespace pointflight
