// What the tests beside Cyclone DDS start from.
#pragma once

#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "tests/ros2/peer.hpp"

namespace pointflight::testing {

/// Flights on ROS 2 of this machine alone, over the map of `Program`.
class Ros2 : public Program {
 protected:
  std::unique_ptr<Flight> fly(const std::string& more = "", const std::string& scenario = "") {
    std::vector<std::string> arguments = {
        scenario.empty() ? map() : scenario, "--ros2", "--ros2-localhost"};
    if (more.find("--epoch") == std::string::npos && more.find("--lockstep") == std::string::npos) {
      arguments.insert(arguments.end(), {"--epoch", "1.7e9"});  // so that stamps say the run's time
    }
    std::istringstream words(more);
    for (std::string word; words >> word;) arguments.push_back(word);
    return std::make_unique<Flight>(arguments, *folder_ / "fly.log");
  }

  /// A scenario that hovers where `scenario new` would start, with LiDARs; `more` goes on top.
  std::string hovering_with(const std::vector<std::string>& lidars,
                            const std::string& map_file,
                            const std::string& more = "") {
    const std::string path = *folder_ / (lidars.front() + ".yaml");
    const auto made = run(fmt::format(
        "scenario new {} -o {} --lidar {} --length 1 --force", map_file, path, lidars.front()));
    EXPECT_EQ(made.code, 0) << made.err;
    std::string mounts;
    for (const std::string& lidar : lidars) mounts += fmt::format("{{model: {}}}, ", lidar);
    const std::string text = read_file(path);
    const auto at = text.find("start: [") + 7;
    const std::string start = text.substr(at, text.find(']', at) + 1 - at);
    write_file(path,
               fmt::format("map: {}\nvehicles:\n  - {{start: {}, lidars: [{}]}}\n"
                           "output: {{scans: false, imu: false}}\n{}",
                           map_file,
                           start,
                           mounts,
                           more));
    return path;
  }
};

}  // namespace pointflight::testing
