#include "pointflight/sim/ros_setup.hpp"

#include <array>

namespace pointflight {
namespace {

constexpr std::array<std::string_view, 2> kRotorUnits = {"si", "rpm"};
constexpr std::array<std::string_view, 2> kFrames = {"world", "body"};
constexpr std::array<std::string_view, 2> kCommandPackages = {"quadrotor_msgs",
                                                              "mars_quadrotor_msgs"};

}  // namespace

void describe(SettingsVisitor& v, RosOutput& s) {
  v.value({"kind", "", "what it says: odometry, imu, cloud, ... (docs/ros.md)"}, s.kind);
  v.value({"topic", "", "{vehicle}, {id}, {lidar} are written out; '-': not sent"}, s.topic);
  v.value({"frame", "", "header.frame_id; empty: the profile's for its kind"}, s.frame);
  v.value({"child_frame", "", "of odometry and tf; '-': none"}, s.child_frame);
  v.value({"rate", "Hz", "at most; 0: each sample; -1: as the profile has it", -1, 10000}, s.rate);
  v.value({"layout", "", "of clouds: livox, livox_custom, velodyne, ouster, xyzi, ..."}, s.layout);
  v.value({"resolution", "m", "of the map's cloud; 0: the map's own", 0, 100}, s.resolution);
}

void describe(SettingsVisitor& v, RosInput& s) {
  v.value({"kind", "", "what it is taken for: position, goal, velocity, ... (docs/ros.md)"},
          s.kind);
  v.value({"topic", "", "{vehicle} and {id} are written out; '-': not read"}, s.topic);
  v.choice({"unit", "", "of rotor speeds: rad/s or rpm"}, s.unit, kRotorUnits);
  v.choice({"frame", "", "of velocities that name no frame"}, s.frame, kFrames);
  v.choice({"package", "", "of a PositionCommand on ROS 2; ROS 1 takes any"},
           s.package,
           kCommandPackages);
}

void describe(SettingsVisitor& v, RosSetup& s) {
  v.value({"profile", "", "whose names: default, marsim, ego, livox, ... or a path"}, s.profile);
  v.value({"epoch", "", "of stamps: now, or seconds since 1970; empty: the profile's"}, s.epoch);
  v.value({"world_alias", "", "another name of the world's frame in what comes in, such as map"},
          s.world_alias);
  v.list({"outputs", "", "of each kind named here, instead of the profile's"},
         s.outputs,
         [](SettingsVisitor& w, RosOutput& output) { describe(w, output); });
  v.list({"inputs", "", "of each kind named here, instead of the profile's"},
         s.inputs,
         [](SettingsVisitor& w, RosInput& input) { describe(w, input); });
}

}  // namespace pointflight
