#include "pointflight/sitl/px4_link.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <any>
#include <cmath>
#include <limits>
#include <utility>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/sitl/frames.hpp"

namespace pointflight {
namespace {

using mavlink::HilSensor;

constexpr std::uint8_t kSystem = 1;  // as other simulators have it
constexpr std::uint8_t kComponent = 200;
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

Px4Link::Px4Link(Px4Options options)
    : options_(std::move(options)),
      clock_("PX4", options_.wait, options_.log),
      server_(Socket::listen_tcp(options_.address, options_.port)),
      offboard_(Socket::bind_udp("0.0.0.0", 0)),
      writer_(kSystem, kComponent),
      offboard_writer_(kSystem, kComponent) {}

void Px4Link::open(const RunDescription& run) {
  const VehicleDescription& vehicle = run.vehicles.at(options_.vehicle);
  motors_.emplace(vehicle.settings);
  sensors_ = vehicle.sensors;
  // the scenario's are among those that every vehicle has, which have no name
  auto setup = vehicle.setup.sensors.begin();
  for (const std::string& kind : sensors_) {
    range_finders_.emplace_back();
    if (kind.empty() || setup == vehicle.setup.sensors.end()) continue;
    const std::any& settings = (setup++)->settings;
    if (kind == "range_finder" && settings.has_value()) {
      range_finders_.back() = std::any_cast<const RangeFinderSettings&>(settings);
    }
  }
  const Vector3d rpy = vehicle.settings.imu.rotation_rpy_deg * kDegree;
  q_body_imu_ = quaternion_from_rpy(rpy.x(), rpy.y(), rpy.z());
  for (const LidarDescription& lidar : vehicle.lidars) T_body_lidar_.push_back(lidar.T_body_sensor);
  band_ = std::max(0.2, half_extent(vehicle.hull).z());
  say(fmt::format("{}: waiting for PX4 at TCP {} port {}",
                  vehicle.setup.name,
                  options_.address,
                  server_.port()));
}

bool Px4Link::is_ready() {
  accept();
  return firmware_.is_open();
}

std::uint64_t Px4Link::usec(SimTime time) const {
  const auto since = std::chrono::duration_cast<std::chrono::microseconds>(time.time_since_epoch());
  return offset_ + static_cast<std::uint64_t>(since.count());
}

void Px4Link::on_sample(const Sample& sample) {
  const auto is_own = [&](std::uint32_t vehicle) { return vehicle == options_.vehicle; };
  if (const auto* imu = std::get_if<ImuSample>(&sample)) {
    if (is_own(imu->vehicle)) take_imu(*imu);
  } else if (const auto* measurement = std::get_if<Measurement>(&sample)) {
    if (is_own(measurement->vehicle)) take_measurement(*measurement);
  } else if (const auto* state = std::get_if<StateSample>(&sample)) {
    if (is_own(state->vehicle)) take_truth(*state);
  } else if (const auto* odometry = std::get_if<OdometrySample>(&sample)) {
    if (is_own(odometry->vehicle) && options_.has_vision) take_odometry(*odometry);
  } else if (const auto* scan = std::get_if<ScanSample>(&sample)) {
    if (is_own(scan->scan->vehicle) && options_.has_obstacles) take_scan(*scan);
  }
}

void Px4Link::take_imu(const ImuSample& sample) {
  const std::uint64_t time = usec(sample.time);
  if (time == 0 || !firmware_.is_open()) return;  // PX4 takes 0 for "no time"
  sensor_.time_usec = time;
  sensor_.acceleration = floats(frd_from_flu(q_body_imu_ * sample.accel));
  sensor_.rates = floats(frd_from_flu(q_body_imu_ * sample.gyro));
  sensor_.updated |= HilSensor::kAccelerometer | HilSensor::kGyroscope;
  writer_.append(sensor_, out_);
  sensor_.updated = 0;
  sent_ = time;
  is_answered_ = false;
  ++report_.sensors;
}

void Px4Link::take_measurement(const Measurement& measurement) {
  const std::string& kind = sensors_.at(measurement.sensor);
  const std::vector<double>& v = measurement.values;
  if (kind == "barometer") {
    const Air air = standard_air(v[0]);
    sensor_.pressure = static_cast<float>(0.01 * v[0]);
    sensor_.pressure_altitude = static_cast<float>(air.altitude);
    sensor_.temperature = static_cast<float>(air.temperature);
    sensor_.updated |= HilSensor::kBarometer;
  } else if (kind == "magnetometer") {
    sensor_.field = floats(kGaussPerMicrotesla * frd_from_flu({v[0], v[1], v[2]}));
    sensor_.updated |= HilSensor::kMagnetometer;
  } else if (kind == "gnss") {
    const Vector3d velocity = ned_from_enu({v[3], v[4], v[5]});
    mavlink::HilGps gps;
    gps.time_usec = usec(measurement.time);
    gps.latitude = whole<std::int32_t>(1e7 * v[0]);
    gps.longitude = whole<std::int32_t>(1e7 * v[1]);
    gps.altitude = whole<std::int32_t>(1e3 * (v[2] - options_.origin.geoid_height));
    gps.horizontal = whole<std::uint16_t>(100.0 * v[6]);
    gps.vertical = whole<std::uint16_t>(100.0 * v[7]);
    gps.speed = whole<std::uint16_t>(100.0 * velocity.head<2>().norm());
    gps.velocity = centimetres(velocity);
    gps.course = course_of(velocity);
    gps.fix = 3;
    gps.satellites = 12;
    writer_.append(gps, out_);
  } else if (kind == "range_finder") {
    const Vector3d rpy = range_finders_.at(measurement.sensor).rotation_rpy_deg * kDegree;
    const Quaterniond q_body_sensor = quaternion_from_rpy(rpy.x(), rpy.y(), rpy.z());
    mavlink::DistanceSensor distance;
    distance.time_boot_ms = static_cast<std::uint32_t>(usec(measurement.time) / 1000);
    distance.least = whole<std::uint16_t>(100.0 * v[1]);
    distance.most = whole<std::uint16_t>(100.0 * v[2]);
    // nothing seen: beyond the greatest
    distance.current = v[0] >= 0.0 ? whole<std::uint16_t>(100.0 * v[0])
                                   : static_cast<std::uint16_t>(std::min(distance.most + 1, 65535));
    distance.id = static_cast<std::uint8_t>(measurement.sensor);
    distance.orientation = orientation_of(q_body_sensor * Vector3d::UnitX());
    const Quaterniond flip(0.0, 1.0, 0.0, 0.0);
    distance.q = floats(flip * q_body_sensor * flip.conjugate());
    distance.quality = v[0] >= 0.0 ? 100 : 1;
    writer_.append(distance, out_);
  }
}

void Px4Link::take_truth(const StateSample& sample) {
  const std::uint64_t time = usec(sample.time);
  const std::optional<StateSample> before = std::exchange(truth_, sample);
  if (!truth_interval_ || time < truth_due_) return;
  truth_due_ = std::max(truth_due_ + *truth_interval_, time);
  const RigidBodyState& body = sample.state.body;
  const EarthOrigin& o = options_.origin;
  const GeodeticPosition place = geodetic({o.latitude, o.longitude, o.altitude}, body.p_world);
  const Vector3d velocity = ned_from_enu(body.v_world);
  Vector3d acceleration = Vector3d::Zero();
  if (before && before->time < sample.time) {
    acceleration = ned_from_enu(body.v_world - before->state.body.v_world) /
                   to_seconds(sample.time - before->time);
  }
  mavlink::HilStateQuaternion truth;
  truth.time_usec = time;
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
  writer_.append(truth, out_);
}

void Px4Link::take_odometry(const OdometrySample& sample) {
  const RigidBodyState& body = sample.state;
  mavlink::Odometry vision;
  vision.time_usec = usec(sample.time);
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
  writer_.append(vision, out_);
}

/// Distances in the level body frame at the end of the scan, clockwise from the front, of what
/// stands at the vehicle's height. A direction is known if anything came back from it.
void Px4Link::take_scan(const ScanSample& sample) {
  const Scan& scan = *sample.scan;
  if (scan.sensor != 0 || scan.beams == 0) return;
  constexpr double kMost = 65.0;  // m
  mavlink::ObstacleDistance message;
  const std::size_t count = message.distances.size();
  const double step = 2.0 * kPi / static_cast<double>(count);
  message.time_usec = usec(scan.end);
  message.least = 20;
  message.most = static_cast<std::uint16_t>(100.0 * kMost);
  message.increment = static_cast<std::uint8_t>(std::lround(step / kDegree));
  message.distances.fill(65535);
  const Pose T_world_body = sample.T_world_sensor.at(scan.end) * T_body_lidar_[0].inverse();
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
    if (std::abs(p.z()) > band_ || away > kMost) continue;
    distance = std::min(distance, whole<std::uint16_t>(100.0 * away));
  }
  std::vector<std::byte> datagram;
  offboard_writer_.append(message, datagram);
  offboard_.send_datagram(options_.address, options_.offboard_port, datagram);
}

void Px4Link::on_step(const StepDone& done) {
  if (!has_spoken_) accept();
  if (!is_answered_ && !out_.empty()) clock_.ask();
  flush();
  receive();
  // until it answers, its start must not race through seconds
  if (!is_locked_) clock_.keep_pace(done.time);
}

void Px4Link::on_wait(SimTime /*now*/, Waiting why) {
  if (!has_spoken_) accept();
  receive();
  if (why == Waiting::kForAnswer) {
    give_up();
  } else {
    clock_.ask();
    clock_.restart_pace();
  }
}

/// Not before an answer is due: a flight task may have stopped to set actuators.
void Px4Link::give_up() {
  if (is_answered_ || !clock_.gives_up()) return;
  ++report_.unanswered;
  is_locked_ = false;
  is_answered_ = true;
  clock_.restart_pace();
  orders_.emplace_back(AnswerOrder{});
}

bool Px4Link::wants_answer(const Sample& sample) const {
  const auto* imu = std::get_if<ImuSample>(&sample);
  return imu != nullptr && imu->vehicle == options_.vehicle && is_locked_ && !is_answered_;
}

bool Px4Link::await_answer(std::chrono::microseconds at_most) {
  if (!firmware_.is_open()) return false;
  firmware_.wait(at_most);
  return true;
}

std::vector<Order> Px4Link::take_orders() {
  return std::exchange(orders_, {});
}

/// One that has said nothing makes way for the next: a stranger must not keep PX4 out.
void Px4Link::accept() {
  Socket other = server_.accept();
  if (!other.is_open()) return;
  firmware_ = std::move(other);
  junk_before_ = report_.junk;
  reader_ = {};
  out_.clear();
  sensor_.updated = 0;
  truth_interval_.reset();
  has_spoken_ = false;
  is_locked_ = false;
  is_answered_ = true;
  clock_.restart_pace();
  say(report_.connections == 0 ? "PX4 has connected" : "PX4 has connected again: from the start");
  if (report_.connections++ > 0) orders_.emplace_back(ResetOrder{});
}

/// Rotors stop with their flight controller.
void Px4Link::disconnect(const std::string& why) {
  say(fmt::format("PX4 is gone ({}); its rotors stop; waiting for another", why));
  firmware_.close();
  out_.clear();
  has_spoken_ = false;
  is_locked_ = false;
  clock_.restart_pace();
  is_answered_ = true;
  is_armed_ = false;
  orders_.emplace_back(VehicleOrder{options_.vehicle, DisarmCommand{}, true});
  orders_.emplace_back(AnswerOrder{});
}

void Px4Link::flush() {
  if (out_.empty() || !firmware_.is_open()) return;
  if (!firmware_.send(out_)) disconnect("it does not read");
  out_.clear();
}

void Px4Link::receive() {
  constexpr int kReads = 16;  // at a time: who floods us does not hold us
  if (!firmware_.is_open()) return;
  for (int i = 0; i < kReads; ++i) {
    const auto bytes = firmware_.receive();
    if (!bytes) return disconnect("it has closed the connection");
    if (bytes->empty()) return;
    reader_.add(*bytes);
    while (const auto frame = reader_.next()) {
      has_spoken_ = true;
      if (const auto controls = mavlink::message_in<mavlink::HilActuatorControls>(*frame)) {
        obey(*controls);
      } else if (const auto command = mavlink::message_in<mavlink::CommandLong>(*frame)) {
        const bool is_truth =
            command->command == mavlink::CommandLong::kSetMessageInterval &&
            std::lround(command->parameters[0]) == mavlink::HilStateQuaternion::kKind.id;
        if (is_truth && command->parameters[1] > 0.0f && command->parameters[1] < 1e9f) {
          truth_interval_ = static_cast<std::uint64_t>(command->parameters[1]);
        }
      }
    }
    report_.junk = junk_before_ + reader_.dropped();
  }
}

void Px4Link::obey(const mavlink::HilActuatorControls& controls) {
  ++report_.answers;
  const bool is_answer = !is_answered_ && controls.time_usec >= sent_;
  const bool is_armed = controls.is_armed();
  if (is_armed != is_armed_) {
    const Command command = is_armed ? Command(ArmCommand{}) : Command(DisarmCommand{});
    orders_.emplace_back(VehicleOrder{options_.vehicle, command, false});
    say(is_armed ? "armed by PX4" : "disarmed by PX4");
  }
  is_armed_ = is_armed;
  if (is_armed) {
    const RotorSpeedCommand speeds{motors_->speeds(controls.controls, true)};
    orders_.emplace_back(VehicleOrder{options_.vehicle, speeds, is_answer});
  } else if (is_answer) {
    orders_.emplace_back(AnswerOrder{});
  }
  // whoever answers is waited for from now on, one that was late before, too
  is_locked_ = true;
  is_answered_ = is_answered_ || is_answer;
}

void Px4Link::on_reset(SimTime reached) {
  offset_ = usec(reached);
  truth_.reset();
  clock_.restart_pace();
  is_armed_ = false;
}

void Px4Link::close() {
  report_.is_cut = is_over();
  flush();
  firmware_.close();
  server_.close();
}

void Px4Link::say(const std::string& line) const {
  if (options_.log) options_.log(line);
}

}  // namespace pointflight
