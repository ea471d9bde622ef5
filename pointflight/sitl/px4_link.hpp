// PX4 in the loop: its simulator interface (PX4, "Simulation", MAVLink API), in lockstep.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/run/link.hpp"
#include "pointflight/sim/navigation_sensors.hpp"
#include "pointflight/sitl/internal/answer_clock.hpp"
#include "pointflight/sitl/internal/mavlink.hpp"
#include "pointflight/sitl/internal/socket.hpp"
#include "pointflight/vehicle/motor_outputs.hpp"

namespace pointflight {

/// How a vehicle is flown by PX4.
struct Px4Options {
  static constexpr std::uint16_t kSimulatorPort = 4560;  ///< Of instance 0.
  static constexpr std::uint16_t kOffboardPort = 14580;  ///< The same.

  std::size_t vehicle = 0;                      ///< Number in the fleet.
  std::string address = "127.0.0.1";            ///< That it listens at.
  std::uint16_t port = kSimulatorPort;          ///< TCP; 0: any that is free.
  std::uint16_t offboard_port = kOffboardPort;  ///< UDP, where PX4 takes `OBSTACLE_DISTANCE`.
  bool has_vision = false;                      ///< Its odometry is sent as external vision.
  bool has_obstacles = false;  ///< What its first LiDAR sees is sent as `OBSTACLE_DISTANCE`.
  double wait = 10.0;          ///< For an answer, s; then the run goes on without.
  EarthOrigin origin;          ///< Of the world.
  std::function<void(const std::string& line)> log;  ///< For users.
  std::function<bool()> is_gone;  ///< True once no firmware will come; empty: one always may.
};

/// What has come of the link.
struct Px4Report {
  std::uint64_t sensors = 0;      ///< HIL_SENSORs that were sent.
  std::uint64_t answers = 0;      ///< HIL_ACTUATOR_CONTROLS that came.
  std::uint64_t unanswered = 0;   ///< HIL_SENSORs that an answer was waited for in vain.
  std::uint64_t connections = 0;  ///< Of firmwares.
  std::uint64_t junk = 0;         ///< Bytes that were no message.
  bool is_cut = false;            ///< The firmware ended before the run did.
};

/// PX4 flies a vehicle. The link is the server; PX4 connects, and from its first actuator message
/// on the run waits, after each IMU sample, for the actuators of that time. Until then, and after
/// answers have stopped, the run goes on at the wall clock's pace. Each sample of IMU,
/// magnetometer, barometer, GNSS and range finders is sent as it was measured, in other frames and
/// units; nothing is added. A new connection after the first starts the run again.
///
/// In lockstep what is sent follows from the run and from what PX4 has answered at which of its
/// times, whatever the machine's load.
class Px4Link : public Link {
 public:
  /// Listens. Throws InputError if it cannot.
  explicit Px4Link(Px4Options options);

  void open(const RunDescription& run) override;
  bool is_ready() override;
  void on_sample(const Sample& sample) override;
  void on_step(const StepDone& done) override;
  void on_wait(SimTime now, Waiting why) override;
  [[nodiscard]] bool wants_answer(const Sample& sample) const override;
  bool await_answer(std::chrono::microseconds at_most) override;
  std::vector<Order> take_orders() override;
  void on_reset(SimTime reached) override;
  void close() override;
  [[nodiscard]] bool is_over() const override { return options_.is_gone && options_.is_gone(); }

  [[nodiscard]] std::uint16_t port() const { return server_.port(); }  ///< That it listens at.
  /// So far.
  [[nodiscard]] const Px4Report& report() const { return report_; }

 private:
  void take_measurement(const Measurement& measurement);
  void take_imu(const ImuSample& sample);
  void take_truth(const StateSample& sample);
  void take_scan(const ScanSample& sample);
  [[nodiscard]] std::uint64_t usec(SimTime time) const;
  void accept();
  void disconnect(const std::string& why);
  void flush();
  void receive();
  void obey(const mavlink::HilActuatorControls& controls);
  void give_up();
  void say(const std::string& line) const;

  Px4Options options_;
  AnswerClock clock_;
  Px4Report report_;
  Socket server_;
  Socket firmware_;
  Socket offboard_;
  mavlink::FrameReader reader_;
  std::uint64_t junk_before_ = 0;  ///< Of earlier connections.
  mavlink::FrameWriter writer_;
  mavlink::FrameWriter offboard_writer_;
  std::vector<std::byte> out_;  ///< Of this step.
  std::vector<Order> orders_;

  // of the vehicle
  std::optional<MotorOutputs> motors_;
  std::vector<std::string> sensors_;                ///< Kinds by number.
  std::vector<RangeFinderSettings> range_finders_;  ///< The same; of others their defaults.
  Quaterniond q_body_imu_ = Quaterniond::Identity();
  std::vector<Pose> T_body_lidar_;
  double band_ = 0.3;  ///< m above and below the body's origin: what stands there is in its way.

  mavlink::HilSensor sensor_;         ///< The next, with what has come since the last.
  std::optional<StateSample> truth_;  ///< The last.
  std::uint64_t offset_ = 0;          ///< us; what a run had before it was started again.
  std::uint64_t sent_ = 0;            ///< us; of the last HIL_SENSOR, 0: none.
  std::optional<std::uint64_t> truth_interval_;  ///< us, as PX4 asked.
  std::uint64_t truth_due_ = 0;                  ///< us
  bool has_spoken_ = false;                      ///< A message has come on this connection.
  bool is_locked_ = false;                       ///< It answers: it is waited for.
  bool is_answered_ = true;                      ///< The last HIL_SENSOR is.
  bool is_armed_ = false;
};

}  // namespace pointflight
