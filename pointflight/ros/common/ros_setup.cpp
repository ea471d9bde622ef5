#include "pointflight/ros/common/ros_setup.hpp"

#include "pointflight/ros/common/output.hpp"
#include "pointflight/ros/common/point_layout.hpp"

namespace pointflight {
namespace {

constexpr Named<RotorUnit> kRotorUnits[] = {{RotorUnit::kSi, "si"}, {RotorUnit::kRpm, "rpm"}};
constexpr Named<VelocityFrame> kFrames[] = {{VelocityFrame::kWorld, "world"},
                                            {VelocityFrame::kBody, "body"}};
constexpr Named<CommandPackage> kCommandPackages[] = {
    {CommandPackage::kQuadrotorMsgs, "quadrotor_msgs"},
    {CommandPackage::kMarsQuadrotorMsgs, "mars_quadrotor_msgs"}};

ScenarioSection section() {
  RosSetup example;
  example.outputs.resize(1);
  example.inputs.resize(1);
  return {.name = "ros",
          .help = "names of messages, for --ros1, --ros2 and --record",
          .settings = RosSetup{},
          .example = example,
          .describe = [](SettingsVisitor& v,
                         std::any& settings) { describe(v, std::any_cast<RosSetup&>(settings)); },
          .models =
              [](std::any& settings) {
                return std::vector<std::string*>{&std::any_cast<RosSetup&>(settings).profile};
              }};
}

// scenarios have it in every program that reads profiles
[[maybe_unused]] const ScenarioSection& kSection = scenario_sections().add(section());

}  // namespace

RosSetup& ros_setup_of(Scenario& scenario) {
  return std::any_cast<RosSetup&>(scenario.sections.try_emplace("ros", RosSetup{}).first->second);
}

const RosSetup& ros_setup_of(const Scenario& scenario) {
  static const RosSetup defaults;
  const auto found = scenario.sections.find("ros");
  return found == scenario.sections.end() ? defaults
                                          : std::any_cast<const RosSetup&>(found->second);
}

void describe(SettingsVisitor& v, RosOutput& s) {
  v.value({"kind", "", "what it says: odometry, imu, cloud, ... (docs/ros.md)"}, s.kind);
  v.value({"topic", "", "{vehicle}, {id}, {lidar} are written out; '-': not sent"}, s.topic);
  v.value({"frame", "", "header.frame_id; empty: the profile's for its kind"}, s.frame);
  const OutputType* type = output_types().find(s.kind);
  v.only_if(
      type == nullptr || type->has_child, "kind: odometry, tf, tf_scan", [&](SettingsVisitor& w) {
        w.value({"child_frame", "", "what is posed; '-': none"}, s.child_frame);
      });
  v.value({"rate", "Hz", "at most; 0: each sample; -1: as the profile has it", -1, 10000}, s.rate);
  const bool has_points = type == nullptr || type->make.type().name == "PointCloud2";
  v.only_if(has_points, "a kind of cloud, or map", [&](SettingsVisitor& w) {
    w.value({"layout", "", "livox, livox_custom, velodyne, ouster, xyzi, ..."}, s.layout);
  });
  const bool is_of_lidar = type == nullptr || (has_points && type->per == OutputType::Per::kLidar);
  v.only_if(is_of_lidar && s.layout != kLivoxCustom,
            "kind: cloud or cloud_world, in any layout but livox_custom",
            [&](auto& w) {
              w.value({"organized",
                       "",
                       "a row for each ring, a column for each firing, NaN without a return"},
                      s.organized);
            });
  v.only_if(s.kind == "map", "kind: map", [&](SettingsVisitor& w) {
    w.value({"resolution", "m", "0: the map's own", 0, 100}, s.resolution);
  });
}

void describe(SettingsVisitor& v, RosInput& s) {
  v.value({"kind", "", "what it is taken for: position, goal, velocity, ... (docs/ros.md)"},
          s.kind);
  v.value({"topic", "", "{vehicle} and {id} are written out; '-': not read"}, s.topic);
  v.only_if(s.kind == "rotors", "kind: rotors", [&](SettingsVisitor& w) {
    w.choice({"unit", "", "rad/s or rpm"}, s.unit, kRotorUnits);
  });
  v.only_if(s.kind == "velocity", "kind: velocity", [&](SettingsVisitor& w) {
    w.choice({"frame", "", "of velocities that name no frame"}, s.frame, kFrames);
  });
  v.only_if(s.kind == "position", "kind: position", [&](SettingsVisitor& w) {
    w.choice({"package", "", "of a PositionCommand on ROS 2; ROS 1 takes any"},
             s.package,
             kCommandPackages);
  });
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
