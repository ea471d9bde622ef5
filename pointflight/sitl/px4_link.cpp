#include "pointflight/sitl/px4_link.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <any>
#include <cmath>
#include <utility>

#include "pointflight/core/constants.hpp"
#include "pointflight/geometry/frames.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/sitl/internal/px4_messages.hpp"

namespace pointflight {
namespace {

using mavlink::HilSensor;

constexpr std::uint8_t kSystem = 1;  // as other simulators have it
constexpr std::uint8_t kComponent = 200;
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
    if (is_own(odometry->vehicle) && options_.has_vision) {
      writer_.append(vision_of(*odometry, usec(odometry->time)), out_);
    }
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
  const std::uint64_t time = usec(measurement.time);
  if (kind == "barometer") {
    put_pressure(measurement.values, sensor_);
  } else if (kind == "magnetometer") {
    put_field(measurement.values, sensor_);
  } else if (kind == "gnss") {
    writer_.append(gps_of(measurement.values, options_.origin, time), out_);
  } else if (kind == "range_finder") {
    const RangeFinderSettings& mount = range_finders_.at(measurement.sensor);
    mavlink::DistanceSensor distance = distance_of(measurement.values, mount, time);
    distance.id = static_cast<std::uint8_t>(measurement.sensor);
    writer_.append(distance, out_);
  }
}

void Px4Link::take_truth(const StateSample& sample) {
  const std::uint64_t time = usec(sample.time);
  const std::optional<StateSample> before = std::exchange(truth_, sample);
  if (!truth_interval_ || time < truth_due_) return;
  truth_due_ = std::max(truth_due_ + *truth_interval_, time);
  Vector3d a_world = Vector3d::Zero();
  if (before && before->time < sample.time) {
    a_world = (sample.state.body.v_world - before->state.body.v_world) /
              to_seconds(sample.time - before->time);
  }
  writer_.append(truth_of(sample.state.body, a_world, options_.origin, time), out_);
}

void Px4Link::take_scan(const ScanSample& sample) {
  if (sample.scan->sensor != 0 || sample.scan->beams == 0) return;
  std::vector<std::byte> datagram;
  offboard_writer_.append(
      obstacles_of(sample, T_body_lidar_.front(), band_, usec(sample.scan->end)), datagram);
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
  // what nobody is there for is not kept
  if (!out_.empty() && firmware_.is_open() && !firmware_.send(out_)) disconnect("it does not read");
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
