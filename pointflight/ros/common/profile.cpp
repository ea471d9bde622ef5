#include "pointflight/ros/common/profile.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <functional>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/ros/common/inputs.hpp"
#include "pointflight/ros/common/output.hpp"
#include "pointflight/ros/common/point_layout.hpp"
#include "pointflight/ros/common/ros_names.hpp"

namespace pointflight {
namespace {

constexpr const char* kClockOutput = "clock";

constexpr Named<StampEpoch> kEpochs[] = {{StampEpoch::kFixed, "fixed"}, {StampEpoch::kNow, "now"}};
constexpr Named<TwistFrame> kTwists[] = {{TwistFrame::kBody, "body"},
                                         {TwistFrame::kWorld, "world"}};
constexpr Named<ImuUnit> kImuUnits[] = {{ImuUnit::kMps2, "mps2"}, {ImuUnit::kG, "g"}};
constexpr Named<ImuGravity> kGravities[] = {{ImuGravity::kUp, "up"}, {ImuGravity::kDown, "down"}};
constexpr std::array<std::string_view, 2> kLivoxPackages = {"livox_ros_driver2",
                                                            "livox_ros_driver"};

using Location = std::function<std::string(const std::string& key)>;

/// Throws if ROS would not take a name; what stands in braces is written out later.
void check_pattern(const std::string& key,
                   const std::string& pattern,
                   bool is_topic,
                   const Location& location) {
  if (pattern.empty() || pattern == "-") return;
  const std::string text = with_names(pattern, {"x", 0, "x"});
  const std::string fault = is_topic ? topic_fault(text) : frame_fault(text);
  if (fault.empty()) return;
  throw InputError(fmt::format("{}: {}: '{}' is no {} for ROS: it {}",
                               location(key),
                               key,
                               pattern,
                               is_topic ? "topic" : "frame",
                               fault));
}

/// Throws if a kind or layout is unknown, or a name is none for ROS; `location` gives file and line
/// of a key.
void check_names(const std::vector<RosOutput>& outputs,
                 const std::vector<RosInput>& inputs,
                 const std::string& prefix,
                 const Location& location) {
  const auto check = [&](const std::string& key, const std::string& value, const auto& names) {
    const std::vector<std::string> known(names.begin(), names.end());
    if (std::find(known.begin(), known.end(), value) != known.end()) return;
    const std::string close = closest_word(value, known);
    std::vector<std::string> named = known;
    std::erase(named, "");  // left open
    throw InputError(fmt::format("{}: {}: '{}' is unknown; {}",
                                 location(key),
                                 key,
                                 value,
                                 close.empty() ? fmt::format("one of: {}", fmt::join(named, ", "))
                                               : fmt::format("did you mean '{}'?", close)));
  };
  std::vector<std::string> layouts = {"", kLivoxCustom};
  for (const PointLayout& layout : point_layouts()) layouts.emplace_back(layout.name);
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    check(fmt::format("{}outputs[{}].kind", prefix, i), outputs[i].kind, output_types().names());
    check(fmt::format("{}outputs[{}].layout", prefix, i), outputs[i].layout, layouts);
    const auto key = [&](const char* name) {
      return fmt::format("{}outputs[{}].{}", prefix, i, name);
    };
    check_pattern(key("topic"), outputs[i].topic, true, location);
    check_pattern(key("frame"), outputs[i].frame, false, location);
    check_pattern(key("child_frame"), outputs[i].child_frame, false, location);
  }
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    check(fmt::format("{}inputs[{}].kind", prefix, i), inputs[i].kind, input_types().names());
    check_pattern(fmt::format("{}inputs[{}].topic", prefix, i), inputs[i].topic, true, location);
  }
}

/// Throws if a vehicle's name cannot be part of a topic.
void check_vehicle_names(const Scenario& scenario) {
  const auto fleet = scenario.fleet();
  for (std::size_t v = 0; v < fleet.size(); ++v) {
    const std::string& name = fleet[v].name;
    if (is_ros_word(name)) continue;
    const std::string key = scenario.vehicle_key(v, "name");
    throw InputError(fmt::format(
        "{}: {}: '{}' is part of ROS topics (/{}/odom), which take letters, digits and _ only; "
        "call it {}",
        scenario.location(key),
        key,
        name,
        name,
        as_ros_word(name)));
  }
}

RosProfile read(SettingsReader& reader, const std::string& path) {
  RosProfile profile;
  describe(reader, profile);
  reader.finish();
  profile.path = path;
  const Location location = [&](const std::string& key) {
    const auto line = reader.lines().find(key);
    return line == reader.lines().end() ? path : fmt::format("{}:{}", path, line->second);
  };
  check_names(profile.outputs, profile.inputs, "", location);
  check_pattern("world_frame", profile.world_frame, false, location);
  check_pattern("body_frame", profile.body_frame, false, location);
  check_pattern("sensor_frame", profile.sensor_frame, false, location);
  return profile;
}

/// Of the kinds that are named in `own`, those instead of `theirs`; open fields stay theirs.
template <class Entry, class Inherit>
std::vector<Entry> merged(std::vector<Entry> theirs,
                          std::vector<Entry> own,
                          const Inherit& inherit) {
  for (Entry& entry : own) {
    const auto base = std::find_if(
        theirs.begin(), theirs.end(), [&](const Entry& e) { return e.kind == entry.kind; });
    if (base != theirs.end()) inherit(entry, *base);
  }
  std::erase_if(theirs, [&](const Entry& e) {
    return std::any_of(
        own.begin(), own.end(), [&](const Entry& entry) { return entry.kind == e.kind; });
  });
  theirs.insert(theirs.end(), own.begin(), own.end());
  return theirs;
}

}  // namespace

void describe(SettingsVisitor& v, RosProfile& s) {
  v.value({"title", "", "whose names these are"}, s.title);
  v.value({"source", "", "where they were read"}, s.source);
  v.value({"world_frame", "", ""}, s.world_frame);
  v.value({"world_alias", "", "another name of it in goals and commands"}, s.world_alias);
  v.value({"body_frame", "", ""}, s.body_frame);
  v.value({"sensor_frame", "", ""}, s.sensor_frame);
  v.value({"first_id", "", "number of the first vehicle", 0, 1000}, s.first_id);
  v.choice({"epoch", "", "stamps from 1.7e9 s on, or from the wall clock's time at the start"},
           s.epoch,
           kEpochs);
  v.choice({"twist", "", "frame of odometry's velocities"}, s.twist, kTwists);
  v.choice({"imu_unit", "", "of accelerations"}, s.imu_unit, kImuUnits);
  v.choice({"imu_gravity", "", "sign of gravity in accelerations; down: MARSIM"},
           s.imu_gravity,
           kGravities);
  v.choice({"livox_package", "", "of CustomMsg on ROS 1"}, s.livox_package, kLivoxPackages);
  v.value({"inflation",
           "m",
           "that its planner keeps from obstacles with the vehicle's middle; 0: not known",
           0,
           10},
          s.inflation);
  v.list({"outputs", "", "what is sent"}, s.outputs, [](SettingsVisitor& w, RosOutput& output) {
    describe(w, output);
  });
  v.list({"inputs", "", "what is read"}, s.inputs, [](SettingsVisitor& w, RosInput& input) {
    describe(w, input);
  });
}

RosProfile load_ros_profile(const std::string& name_or_path, const std::string& base) {
  const std::string path = find_model("ros_profiles", name_or_path, base);
  SettingsReader reader(path);
  return read(reader, path);
}

RosProfile parse_ros_profile(std::string_view text, const std::string& path) {
  SettingsReader reader(text, path);
  return read(reader, path);
}

bool has_clock(const RosProfile& profile) {
  return std::any_of(profile.outputs.begin(), profile.outputs.end(), [](const RosOutput& output) {
    return output.kind == kClockOutput && is_used(output.topic);
  });
}

void add_clock(RosProfile& profile) {
  if (has_clock(profile)) return;
  std::erase_if(profile.outputs, [](const RosOutput& o) { return o.kind == kClockOutput; });
  RosOutput clock;
  clock.kind = kClockOutput;
  clock.topic = "/clock";
  clock.rate = 100.0;
  profile.outputs.insert(profile.outputs.begin(), std::move(clock));
}

RosProfile profile_for(const Scenario& scenario, const std::string& name) {
  const RosSetup& ros = ros_setup_of(scenario);
  RosProfile profile =
      name.empty() ? scenario.at("ros.profile",
                                 [&] { return load_ros_profile(ros.profile, scenario.folder()); })
                   : load_ros_profile(name);
  check_vehicle_names(scenario);
  check_names(ros.outputs, ros.inputs, "ros.", [&](const std::string& key) {
    return scenario.location(key);
  });
  if (!ros.world_alias.empty()) profile.world_alias = ros.world_alias;
  const auto take = [](std::string& own, const std::string& base) {
    if (own.empty()) own = base;
  };
  profile.outputs =
      merged(profile.outputs, ros.outputs, [&](RosOutput& own, const RosOutput& base) {
        take(own.topic, base.topic);
        take(own.frame, base.frame);
        take(own.child_frame, base.child_frame);
        take(own.layout, base.layout);
        if (own.rate < 0.0) own.rate = base.rate;
        own.organized = own.organized || base.organized;
        if (own.resolution <= 0.0) own.resolution = base.resolution;
      });
  profile.inputs = merged(profile.inputs, ros.inputs, [&](RosInput& own, const RosInput& base) {
    take(own.topic, base.topic);
  });
  return profile;
}

RosNames names_of(const RosProfile& profile, const VehicleSetup& setup, std::size_t vehicle) {
  return {setup.name, profile.first_id + static_cast<std::int64_t>(vehicle), ""};
}

std::string body_frame_of(const RosProfile& profile, const RosNames& names, std::size_t vehicle) {
  const bool apart = vehicle == 0 || names_vehicle(profile.body_frame);
  return (apart ? "" : names.vehicle + "/") + with_names(profile.body_frame, names);
}

bool is_used(const std::string& topic) {
  return !topic.empty() && topic != "-";
}

std::string bare_frame(const std::string& frame) {
  return frame.starts_with('/') ? frame.substr(1) : frame;
}

std::string absolute(const std::string& topic) {
  return topic.starts_with('/') ? topic : "/" + topic;
}

bool names_vehicle(const std::string& pattern) {
  return pattern.find("{id}") != std::string::npos ||
         pattern.find("{vehicle}") != std::string::npos;
}

std::string with_names(const std::string& pattern, const RosNames& names) {
  std::string text;
  for (std::size_t i = 0; i < pattern.size();) {
    const auto is = [&](std::string_view word) {
      return pattern.compare(i, word.size(), word) == 0;
    };
    if (is("{vehicle}")) {
      text += names.vehicle;
      i += 9;
    } else if (is("{id}")) {
      text += std::to_string(names.id);
      i += 4;
    } else if (is("{lidar}")) {
      text += names.lidar;
      i += 7;
    } else {
      text += pattern[i++];
    }
  }
  return text;
}

}  // namespace pointflight
