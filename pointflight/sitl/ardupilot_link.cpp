#include "pointflight/sitl/ardupilot_link.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "pointflight/core/constants.hpp"
#include "pointflight/geometry/frames.hpp"
#include "pointflight/geometry/rotation.hpp"

namespace pointflight {
namespace {

constexpr std::uint16_t kMagic16 = 18458;
constexpr std::uint16_t kMagic32 = 29569;
constexpr double kPulseLow = 1000.0;  // us
constexpr double kPulseSpan = 1000.0;

template <class Number>
Number number_at(std::span<const std::byte> bytes, std::size_t at) {
  Number number = 0;
  for (std::size_t i = 0; i < sizeof(Number); ++i) {
    number |= static_cast<Number>(std::to_integer<Number>(bytes[at + i]) << (8 * i));
  }
  return number;
}

/// "[1.0,2.0,3.0]": the reader on the other side wants plain numbers and no blanks.
std::string list(const Vector3d& v) {
  return fmt::format("[{:.9f},{:.9f},{:.9f}]", v.x(), v.y(), v.z());
}

}  // namespace

std::optional<ServoPacket> servo_packet_in(std::span<const std::byte> datagram) {
  constexpr std::size_t kHeader = 8;
  if (datagram.size() < kHeader) return std::nullopt;
  const auto magic = number_at<std::uint16_t>(datagram, 0);
  const std::size_t count = magic == kMagic16 ? 16 : magic == kMagic32 ? 32 : 0;
  if (count == 0 || datagram.size() != kHeader + 2 * count) return std::nullopt;
  ServoPacket packet;
  packet.rate = number_at<std::uint16_t>(datagram, 2);
  packet.frame = number_at<std::uint32_t>(datagram, 4);
  for (std::size_t i = 0; i < count; ++i) {
    packet.pulses.push_back(number_at<std::uint16_t>(datagram, kHeader + 2 * i));
  }
  return packet;
}

ArduPilotLink::ArduPilotLink(ArduPilotOptions options)
    : options_(std::move(options)),
      clock_("ArduPilot", options_.wait, options_.log),
      socket_(Socket::bind_udp(options_.address, options_.port)) {}

void ArduPilotLink::open(const RunDescription& run) {
  const VehicleDescription& vehicle = run.vehicles.at(options_.vehicle);
  motors_.emplace(vehicle.settings);
  sensors_ = vehicle.sensors;
  const Vector3d rpy = vehicle.settings.imu.rotation_rpy_deg * kDegree;
  q_body_imu_ = quaternion_from_rpy(rpy.x(), rpy.y(), rpy.z());
  say(fmt::format("{}: waiting for ArduPilot at UDP {} port {}",
                  vehicle.setup.name,
                  options_.address,
                  socket_.port()));
}

bool ArduPilotLink::is_ready() {
  receive();
  return client_.has_value();
}

void ArduPilotLink::on_sample(const Sample& sample) {
  if (const auto* imu = std::get_if<ImuSample>(&sample)) {
    if (imu->vehicle != options_.vehicle) return;
    imu_ = *imu;
    if (steps_left_ > 0) --steps_left_;
    is_waiting_ = is_locked_ && steps_left_ == 0;
  } else if (const auto* measurement = std::get_if<Measurement>(&sample)) {
    if (measurement->vehicle != options_.vehicle) return;
    if (sensors_.at(measurement->sensor) != "range_finder") return;
    const double range = measurement->values[0];
    // nothing seen: beyond the greatest
    ranges_[measurement->sensor] = range >= 0.0 ? range : measurement->values[2] + 1.0;
  }
}

void ArduPilotLink::on_step(const StepDone& done) {
  if (imu_ && client_ && steps_left_ == 0) answer(done.time);
  receive();
  if (!is_locked_) clock_.keep_pace(done.time);
}

/// What the IMU has measured at the start of the step, and where the vehicle is at its end.
void ArduPilotLink::answer(SimTime now) {
  const RigidBodyState body = options_.truth();
  const Quaterniond q = q_ned_frd(body.q_world_body);
  const double time = to_seconds(before_ + now.time_since_epoch());
  std::string text = fmt::format(
      "\n{{\"timestamp\":{:.6f},\"imu\":{{\"gyro\":{},\"accel_body\":{}}},\"position\":{},"
      "\"velocity\":{},\"quaternion\":[{:.9f},{:.9f},{:.9f},{:.9f}],\"no_time_sync\":true",
      time,
      list(frd_from_flu(q_body_imu_ * imu_->gyro)),
      list(frd_from_flu(q_body_imu_ * imu_->accel)),
      list(ned_from_enu(body.p_world)),
      list(ned_from_enu(body.v_world)),
      q.w(),
      q.x(),
      q.y(),
      q.z());
  int number = 0;
  for (const auto& [sensor, range] : ranges_) {
    if (++number > 6) break;  // it takes no more
    text += fmt::format(",\"rng_{}\":{:.3f}", number, range);
  }
  last_answer_ = text + "}\n";
  socket_.answer(*client_, std::as_bytes(std::span(last_answer_)));
  clock_.ask();
}

void ArduPilotLink::receive() {
  constexpr int kDatagrams = 64;  // at a time: who floods us does not hold us
  for (int i = 0; i < kDatagrams; ++i) {
    const auto datagram = socket_.receive_datagram();
    if (!datagram) return;
    take(*datagram);
  }
}

void ArduPilotLink::take(const Socket::Datagram& datagram) {
  const auto packet = servo_packet_in(datagram.bytes);
  if (!packet) {
    ++report_.junk;
    return;
  }
  if (!client_) say("ArduPilot has sent its first packet");
  client_ = datagram;
  if (frame_ && packet->frame == *frame_) {
    ++report_.repeated;
    // it has not heard the answer
    if (is_waiting_) socket_.answer(datagram, std::as_bytes(std::span(last_answer_)));
    return;
  }
  if (frame_ && packet->frame < *frame_) {
    say("ArduPilot has started again: from the start");
    orders_.emplace_back(ResetOrder{});
  }
  frame_ = packet->frame;
  ++report_.packets;
  obey(*packet);
}

void ArduPilotLink::obey(const ServoPacket& packet) {
  std::vector<float> outputs;
  for (const std::uint16_t pulse : packet.pulses) {
    outputs.push_back(static_cast<float>((static_cast<double>(pulse) - kPulseLow) / kPulseSpan));
  }
  const std::size_t motors = std::min(outputs.size(), motors_->rotors().size());
  const bool is_armed = std::any_of(outputs.begin(),
                                    outputs.begin() + static_cast<std::ptrdiff_t>(motors),
                                    [](float output) { return output > 0.0f; });
  if (std::exchange(is_armed_, is_armed) != is_armed) {
    const Command command = is_armed ? Command(ArmCommand{}) : Command(DisarmCommand{});
    orders_.emplace_back(VehicleOrder{options_.vehicle, command, false});
    say(is_armed ? "armed by ArduPilot" : "disarmed by ArduPilot");
  }
  const double frames = 1.0 / std::max<double>(1.0, packet.rate);
  steps_left_ = std::max(1, static_cast<int>(std::lround(frames / options_.physics_step)));
  // an answer that nobody waits for would be taken for the next one
  const bool is_answer = std::exchange(is_waiting_, false);
  is_locked_ = true;
  if (is_armed) {
    const RotorSpeedCommand speeds{motors_->speeds(outputs, true)};
    orders_.emplace_back(VehicleOrder{options_.vehicle, speeds, is_answer});
  } else if (is_answer) {
    orders_.emplace_back(AnswerOrder{});
  }
}

bool ArduPilotLink::wants_answer(const Sample& sample) const {
  const auto* imu = std::get_if<ImuSample>(&sample);
  return imu != nullptr && imu->vehicle == options_.vehicle && is_waiting_;
}

bool ArduPilotLink::await_answer(std::chrono::microseconds at_most) {
  socket_.wait(at_most);
  return true;
}

void ArduPilotLink::on_wait(SimTime /*now*/, Waiting why) {
  receive();
  if (why != Waiting::kForAnswer) {
    clock_.ask();
    clock_.restart_pace();
    return;
  }
  if (!is_waiting_ || !clock_.gives_up()) return;
  ++report_.unanswered;
  is_waiting_ = false;
  is_locked_ = false;
  clock_.restart_pace();
  orders_.emplace_back(AnswerOrder{});
}

std::vector<Order> ArduPilotLink::take_orders() {
  return std::exchange(orders_, {});
}

void ArduPilotLink::on_reset(SimTime reached) {
  before_ += reached.time_since_epoch();
  imu_.reset();
  ranges_.clear();
  is_armed_ = false;
  clock_.restart_pace();
}

void ArduPilotLink::say(const std::string& line) const {
  if (options_.log) options_.log(line);
}

}  // namespace pointflight
