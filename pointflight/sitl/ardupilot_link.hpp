// ArduPilot in the loop: its JSON interface (ArduPilot, libraries/SITL/examples/JSON), in lockstep.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pointflight/run/link.hpp"
#include "pointflight/sitl/internal/answer_clock.hpp"
#include "pointflight/sitl/internal/socket.hpp"
#include "pointflight/vehicle/motor_outputs.hpp"

namespace pointflight {

/// How a vehicle is flown by ArduPilot.
struct ArduPilotOptions {
  static constexpr std::uint16_t kPort = 9002;      ///< Of instance 0.
  static constexpr std::uint16_t kPortsApart = 10;  ///< From instance to instance.

  std::size_t vehicle = 0;                ///< Number in the fleet.
  std::string address = "127.0.0.1";      ///< That it listens at.
  std::uint16_t port = kPort;             ///< UDP; 0: any that is free.
  double wait = 10.0;                     ///< For the next packet, s; then the run goes on without.
  double physics_step = 0.001;            ///< s
  std::function<RigidBodyState()> truth;  ///< Of the vehicle, at the end of the last step.
  std::function<void(const std::string& line)> log;  ///< For users.
};

/// What has come of the link.
struct ArduPilotReport {
  std::uint64_t packets = 0;     ///< Of servos, repeats left out.
  std::uint64_t repeated = 0;    ///< Packets that came again.
  std::uint64_t unanswered = 0;  ///< Answers of ours that no packet followed in time.
  std::uint64_t junk = 0;        ///< Datagrams that were none.
};

/// A packet of servo outputs.
struct ServoPacket {
  std::uint16_t rate = 0;             ///< Frames a second that ArduPilot means to have.
  std::uint32_t frame = 0;            ///< Its number.
  std::vector<std::uint16_t> pulses;  ///< us, 16 or 32; 0: no output.
};

/// Of a datagram; nothing if it is none.
std::optional<ServoPacket> servo_packet_in(std::span<const std::byte> datagram);

/// ArduPilot flies a vehicle: for each packet of servo outputs the run does the steps of one of its
/// frames, and answers with what the IMU measured and where the vehicle is. ArduPilot makes its
/// other sensors of that itself. A frame number that jumps back starts the run again.
class ArduPilotLink : public Link {
 public:
  /// Listens. Throws InputError if it cannot.
  explicit ArduPilotLink(ArduPilotOptions options);

  void open(const RunDescription& run) override;
  bool is_ready() override;
  void on_sample(const Sample& sample) override;
  void on_step(const StepDone& done) override;
  void on_wait(SimTime now, Waiting why) override;
  [[nodiscard]] bool wants_answer(const Sample& sample) const override;
  bool await_answer(std::chrono::microseconds at_most) override;
  std::vector<Order> take_orders() override;
  void on_reset(SimTime reached) override;
  void close() override { socket_.close(); }

  [[nodiscard]] std::uint16_t port() const { return socket_.port(); }  ///< That it listens at.
  /// So far.
  [[nodiscard]] const ArduPilotReport& report() const { return report_; }

 private:
  void receive();
  void take(const Socket::Datagram& datagram);
  void obey(const ServoPacket& packet);
  void answer(SimTime now);
  void say(const std::string& line) const;

  ArduPilotOptions options_;
  AnswerClock clock_;
  ArduPilotReport report_;
  Socket socket_;
  std::vector<Order> orders_;

  // of the vehicle
  std::optional<MotorOutputs> motors_;
  std::vector<std::string> sensors_;  ///< Kinds by number.
  Quaterniond q_body_imu_ = Quaterniond::Identity();

  std::optional<ImuSample> imu_;
  std::map<std::uint32_t, double> ranges_;  ///< m, of range finders by number.
  std::optional<Socket::Datagram> client_;  ///< The last packet, for where it came from.
  std::optional<std::uint32_t> frame_;      ///< Its number.
  std::string last_answer_;
  Duration before_{0};  ///< What a run had before it was started again.
  int steps_left_ = 0;  ///< Of the frame under way.
  bool is_locked_ = false;
  bool is_waiting_ = false;  ///< For the next packet.
  bool is_armed_ = false;
};

}  // namespace pointflight
