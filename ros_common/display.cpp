#include "ros_common/display.hpp"

#include <fmt/format.h>

#include "ros_common/conversion.hpp"

namespace pointflight {
namespace {

constexpr msg::ColorRGBA kVehicleColor{0.0f, 0.45f, 0.70f, 0.9f};

msg::KeyValue key_value(const char* key, const std::string& value) {
  return {key, value};
}

}  // namespace

msg::Marker vehicle_marker(OutputKind kind,
                           const VehicleAgent& agent,
                           const RigidBodyState& state,
                           const msg::Header& header,
                           const std::string& ns,
                           std::span<const msg::PoseStamped> flown) {
  const Pose pose = state.T_world_body();
  const auto id = static_cast<std::int32_t>(agent.number());
  msg::Marker marker = marker_of(agent.hull(), pose, header, ns, id, kVehicleColor);
  switch (kind) {
    case OutputKind::kVelocity:
      marker.type = msg::Marker::kArrow;
      marker.pose = {};
      marker.scale = {0.05, 0.1, 0.1};  // shaft, head, head's length
      marker.points = {point_of(state.p_world),
                       point_of(Vector3d(state.p_world + 0.5 * state.v_world))};
      break;
    case OutputKind::kTrajectory:
      marker.type = msg::Marker::kLineStrip;
      marker.pose = {};
      marker.scale = {0.05, 0.0, 0.0};
      for (const auto& entry : flown) marker.points.push_back(entry.pose.position);
      break;
    case OutputKind::kCovariance:
      marker.type = msg::Marker::kSphere;  // of the truth: a point
      marker.scale = {1e-3, 1e-3, 1e-3};
      break;
    case OutputKind::kSensorModel:
      marker.type = msg::Marker::kCylinder;
      if (!agent.lidars().empty()) marker.pose = pose_of(pose * agent.lidars()[0]->T_body_sensor());
      marker.scale = {0.08, 0.08, 0.06};
      break;
    case OutputKind::kLabel:
      marker.type = msg::Marker::kText;
      marker.pose.position.z += 0.5;
      marker.scale = {0.0, 0.0, 0.3};
      marker.text = agent.setup().name;
      break;
    default:
      break;
  }
  return marker;
}

msg::DiagnosticArray diagnostics_of(const Simulation& simulation,
                                    SimTime time,
                                    const msg::Header& header,
                                    std::uint64_t refused,
                                    const std::string& last_refused) {
  msg::DiagnosticArray message;
  message.header = header;
  for (std::size_t v = 0; v < simulation.vehicle_count(); ++v) {
    const VehicleStatus& s = simulation.status(v);
    msg::DiagnosticStatus status;
    status.name = "pointflight: " + simulation.vehicle(v).setup().name;
    status.hardware_id = simulation.vehicle(v).setup().model;
    constexpr auto kWarn = msg::Octet{1};
    constexpr auto kError = msg::Octet{2};
    if (s.crashed) {
      status.level = kError;
      status.message = "crashed";
    } else if (!s.proximity.touching.empty()) {
      status.level = kWarn;
      status.message = "in contact";
    } else {
      status.message = s.landed ? "on the ground" : name_of(s.autopilot.command);
    }
    status.values = {
        key_value("time", fmt::format("{:.3f}", to_seconds(time))),
        key_value("command", name_of(s.autopilot.command)),
        key_value("armed", s.autopilot.armed ? "true" : "false"),
        key_value("clearance",
                  s.proximity.nearest ? fmt::format("{:.2f}", s.proximity.nearest->distance) : ""),
        key_value("collisions", fmt::format("{}", s.summary.collisions)),
        key_value("commands_rejected", fmt::format("{}", s.autopilot.rejected)),
        key_value("last_rejection", s.autopilot.last_rejection),
        key_value("messages_refused", fmt::format("{}", refused)),
        key_value("last_message_refused", last_refused),
        key_value("command_timeouts", fmt::format("{}", s.autopilot.timeouts)),
        key_value("scans", fmt::format("{}", s.summary.scans))};
    message.status.push_back(std::move(status));
  }
  return message;
}

}  // namespace pointflight
