#pragma once

#include <CLI/App.hpp>
#include <memory>
#include <string>
#include <vector>

#include "ros_common/bridge.hpp"

namespace pointflight::apps {

/// Flags of `fly` for ROS and recordings.
struct RosFlags {
  std::string profile;               ///< Empty: the scenario's.
  std::string epoch;                 ///< Empty: the scenario's or profile's.
  std::vector<std::string> records;  ///< Files.
  std::string compression = "zstd";
};

void add_ros_flags(CLI::App& app, RosFlags& flags);

/// What a profile needs of a scenario: samples as often as it sends them. Throws InputError.
void prepare_for_ros(const RosFlags& flags, Scenario& scenario);

/// The recordings of a flight, and the bridge that feeds them.
class RosSession {
 public:
  /// Opens everything that the flags ask for. Throws InputError.
  RosSession(const RosFlags& flags, const Simulation& simulation);
  ~RosSession();

  /// Where samples go, or null where nothing was asked for.
  [[nodiscard]] SampleSink* sink() { return bridge_.get(); }
  void start();
  void on_time(SimTime time);
  /// Recordings get their names; says what was recorded.
  void close();

 private:
  std::vector<std::string> paths_;
  std::vector<std::unique_ptr<Outlet>> outlets_;
  std::unique_ptr<RosBridge> bridge_;
};

}  // namespace pointflight::apps
