#pragma once

#include <CLI/App.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "recording/recording.hpp"
#include "ros_common/bridge.hpp"
#include "ros_common/inputs.hpp"

namespace pointflight::apps {

/// Flags of `fly` for ROS and recordings.
struct RosFlags {
  bool ros1 = false;
  bool ros2 = false;
  bool localhost = false;  ///< ROS 2: no other machine.
  std::string node = "pointflight";
  bool no_wait = false;              ///< Fly on without a master.
  std::string profile;               ///< Empty: the scenario's.
  std::string epoch;                 ///< Empty: the scenario's or profile's.
  bool stay = false;                 ///< Hover when the mission is flown.
  bool no_stay = false;              ///< End with the mission.
  double lockstep = 0.0;             ///< Wait so long for an answer to each scan, s; 0: not at all.
  std::vector<std::string> records;  ///< Files.
  std::string compression = "zstd";
  bool overwrite = false;  ///< Recordings that are there already.

  /// Somebody outside may listen and command.
  [[nodiscard]] bool is_live() const { return ros1 || ros2; }
  [[nodiscard]] bool any() const { return is_live() || !records.empty(); }
};

void add_ros_flags(CLI::App& app, RosFlags& flags);

/// Throws InputError for a flag that has no effect without others.
void check_ros_flags(const RosFlags& flags);

/// What a profile needs of a scenario: samples as often as it sends them. A live flight goes on
/// until it is interrupted where nobody has planned it, and after its mission where it is flown in
/// real time (`rate` > 0) and not told to end (--no-stay, a duration, lockstep). Throws InputError.
void prepare_for_ros(const RosFlags& flags, double rate, Scenario& scenario);

/// ROS and the recordings of a flight, the bridge that feeds them, and what they ask for.
class RosSession {
 public:
  /// Opens everything that the flags ask for. Throws InputError.
  RosSession(const RosFlags& flags, Simulation& simulation);
  ~RosSession();

  /// Where samples go, or null where nothing was asked for.
  [[nodiscard]] SampleSink* sink();
  /// How late an instant of the run is by the wall clock, s; nothing where it is not held to it.
  using Lateness = std::function<std::optional<double>(SimTime time)>;
  void measure_lateness(Lateness lateness);

  /// Connects; waits for a master where there is none yet. False where the flight is over already.
  /// Throws InputError where the master is none.
  bool start();

  /// What has to be done before the next step.
  enum class Next { kStep, kWait, kReset };
  /// Call after each step, which `took` so many seconds: sends what follows the clock, gives
  /// commands to the vehicles, waits for a planner in lockstep. `kWait`: paused; ask again.
  Next after_step(double took = 0.0);

  /// True once the flight has to end: the user's interrupt, or a ROS that has ended the node.
  [[nodiscard]] bool is_over() const;

  /// After the simulation was set back to its start.
  void was_reset(SimTime reached);

  /// Recordings get their names; says what was recorded, how late scans left, what went wrong.
  void close();

  /// Recordings that could not be written to their end; it was said.
  [[nodiscard]] std::size_t failed_recordings() const;

 private:
  class ScanCount;
  void open_recording(const std::string& path, Duration epoch);
  void say_failed_recordings();
  void close_transports();
  bool wait_for_planner();
  void take_orders();
  void wait_for_answer();
  void say_troubles();

  RosFlags flags_;
  Simulation& simulation_;
  std::vector<std::unique_ptr<Recording>> recordings_;
  std::unique_ptr<Inbox> inbox_;  ///< Outlives the transports, whose threads fill it.
  std::vector<std::unique_ptr<Transport>> transports_;
  std::unique_ptr<RosBridge> bridge_;
  std::unique_ptr<ScanCount> scans_;
  std::unique_ptr<SampleSplitter> splitter_;
  bool paused_ = false;
  bool step_once_ = false;
  bool reset_ = false;
  std::uint64_t answers_ = 0;
  std::uint64_t late_answers_ = 0;
  std::uint64_t told_refused_ = 0;
  std::uint64_t said_rejected_ = 0;
};

}  // namespace pointflight::apps
