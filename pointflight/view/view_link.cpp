#include "pointflight/view/view_link.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "pointflight/ros/common/codec.hpp"
#include "pointflight/ros/common/description.hpp"
#include "pointflight/ros/common/output.hpp"
#include "pointflight/ros/common/point_layout.hpp"
#include "pointflight/ros/common/scan_messages.hpp"

namespace pointflight {
namespace {

using nlohmann::json;

constexpr auto kStateBetween = std::chrono::milliseconds(33);
constexpr double kRateWindow = 0.5;          // s that the real-time factor is a mean over
constexpr std::size_t kMostObstacles = 500;  // that a state says

json list_of(const Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}
json list_of(const Quaterniond& q) {
  return {q.w(), q.x(), q.y(), q.z()};
}

json shape_of(const Solid& solid) {
  return {{"kind", name_of(solid)}, {"half", list_of(half_extent(solid))}};
}

json parts_of(const VehicleDescription& vehicle) {
  json parts = json::array();
  if (!vehicle.look) {
    parts.push_back({{"shape", shape_of(vehicle.hull)}, {"p", {0, 0, 0}}, {"q", {1, 0, 0, 0}}});
    return parts;
  }
  for (const AssemblyPart& part : vehicle.look->parts) {
    parts.push_back({{"shape", shape_of(part.solid)},
                     {"p", list_of(part.T_assembly_part.translation)},
                     {"q", list_of(part.T_assembly_part.rotation)}});
  }
  return parts;
}

json propellers_of(const VehicleDescription& vehicle) {
  json propellers = json::array();
  if (!vehicle.look) return propellers;
  for (const Propeller& p : vehicle.look->propellers) {
    propellers.push_back({{"p", list_of(p.center)},
                          {"radius", p.radius},
                          {"chord", p.chord},
                          {"pitch", p.pitch},
                          {"blades", p.blades},
                          {"speed", p.speed}});
  }
  return propellers;
}

json json_of(const VehicleDescription& vehicle, std::size_t number) {
  json lidars = json::array();
  const std::vector<std::string> names = lidar_names(vehicle.setup);
  for (std::size_t l = 0; l < vehicle.lidars.size(); ++l) {
    const LidarDescription& lidar = vehicle.lidars[l];
    lidars.push_back({{"name", names[l]},
                      {"title", lidar.settings.title},
                      {"p", list_of(lidar.T_body_sensor.translation)},
                      {"q", list_of(lidar.T_body_sensor.rotation)},
                      {"topic", "/pointflight/" + vehicle.setup.name + "/" + names[l]}});
  }
  json mission = json::array();
  for (const Vector3d& w : vehicle.setup.mission.waypoints) mission.push_back(list_of(w));
  return {{"name", vehicle.setup.name},
          {"label", kFirstVehicle + number},
          {"title", vehicle.settings.title},
          {"hull", shape_of(vehicle.hull)},
          {"parts", parts_of(vehicle)},
          {"propellers", propellers_of(vehicle)},
          {"lidars", lidars},
          {"start", list_of(vehicle.setup.start)},
          {"mission", mission}};
}

Bytes bytes_of(const json& value) {
  const std::string text = value.dump(-1, ' ', false, json::error_handler_t::replace);
  const auto* data = reinterpret_cast<const std::byte*>(text.data());
  return std::make_shared<const std::vector<std::byte>>(data, data + text.size());
}

foxglove::Channel json_channel(const std::string& topic, const std::string& schema) {
  foxglove::Channel channel;
  channel.topic = topic;
  channel.encoding = "json";
  channel.schema_name = schema;
  channel.schema = R"({"type":"object"})";
  channel.schema_encoding = "jsonschema";
  return channel;
}

/// What one thing is doing, rounded as a page needs it: a millimetre, a ten-thousandth.
double rounded(double value, double step) {
  return std::round(value / step) * step;
}

}  // namespace

ViewLink::ViewLink(std::shared_ptr<LiveServer> server, Duration epoch)
    : server_(std::move(server)), epoch_(epoch) {
  run_ = server_->add_channel(json_channel("/pointflight/run", "pointflight.Run"), true);
  state_ = server_->add_channel(json_channel("/pointflight/state", "pointflight.State"), true);
  events_ = server_->add_channel(json_channel("/pointflight/events", "pointflight.Event"), false);
}

ViewLink::~ViewLink() {
  server_->close();
}

std::int64_t ViewLink::stamp(SimTime time) const {
  return (time.time_since_epoch() + epoch_).count();
}

void ViewLink::open(const RunDescription& run) {
  json vehicles = json::array();
  vehicles_.resize(run.vehicles.size());
  for (std::size_t v = 0; v < run.vehicles.size(); ++v) {
    vehicles.push_back(json_of(run.vehicles[v], v));
    names_.push_back(run.vehicles[v].setup.name);
    motions_.push_back(run.vehicles[v].setup.mission.motion);
    for (const json& lidar : vehicles.back()["lidars"]) {
      foxglove::Channel channel;
      channel.topic = lidar["topic"];
      channel.encoding = "cdr";
      const MessageType type = message_type<msg::PointCloud2>();
      channel.schema_name = type.ros2_name();
      channel.schema = type.ros2_definition;
      channel.schema_encoding = "ros2msg";
      vehicles_[v].scans.push_back(server_->add_channel(std::move(channel), false));
    }
  }
  const Aabb& bounds = run.map->bounds_world();
  map_frame_ = map_frame_for(bounds, {});
  const json description = {
      {"seed", run.seed},
      {"vehicles", vehicles},
      {"epoch", std::to_string(epoch_.count())},  // ns: more than a JSON number holds
      {"cloud_origin", list_of(map_frame_.origin)},
      {"map",
       {{"surfels", run.map->surfel_count()},
        {"resolution", run.map->resolution()},
        {"min", list_of(bounds.min)},
        {"max", list_of(bounds.max)}}}};
  server_->publish(run_, bytes_of(description), stamp(SimTime{}));
  inbox_.take_orders_of(*server_, motions_);
}

void ViewLink::let_play_back() {
  inbox_.take_playback_of(*server_, epoch_);
}

void ViewLink::publish_playback(const PlaybackStatus& status) {
  server_->publish_playback(OrderInbox::state_of(status, epoch_));
}

std::vector<Order> ViewLink::take_orders() {
  return inbox_.take();
}

void ViewLink::on_sample(const Sample& sample) {
  if (const auto* state = std::get_if<StateSample>(&sample)) {
    vehicles_[state->vehicle].state = *state;
  } else if (const auto* status = std::get_if<StatusSample>(&sample)) {
    vehicles_[status->vehicle].status = *status;
  } else if (const auto* obstacles = std::get_if<ObstacleSample>(&sample)) {
    obstacles_ = *obstacles;
  } else if (const auto* scan = std::get_if<ScanSample>(&sample)) {
    publish_scan(*scan);
  } else if (const auto* event = std::get_if<VehicleEvent>(&sample)) {
    publish_event(event->time, event->vehicle, event->words);
    // of another process: where it is comes as long as it is there
    if (event->kind == "lost" || event->kind == "left") vehicles_[event->vehicle].status.reset();
  } else if (const auto* collision = std::get_if<CollisionEvent>(&sample)) {
    if (collision->entered) publish_event(collision->time, collision->vehicle, "collision");
  }
}

void ViewLink::publish_event(SimTime time, std::size_t vehicle, const std::string& words) {
  if (!server_->has_subscribers(events_)) return;
  server_->publish(
      events_,
      bytes_of({{"t", to_seconds(time)}, {"vehicle", names_[vehicle]}, {"words", words}}),
      stamp(time));
}

void ViewLink::publish_scan(const ScanSample& sample) {
  const Scan& scan = *sample.scan;
  const std::uint32_t channel = vehicles_[scan.vehicle].scans[scan.sensor];
  if (!server_->has_subscribers(channel)) return;
  const auto points = world_points(scan, sample.T_world_sensor, map_frame_.origin);
  const std::string frame = map_frame_.is_used() ? map_frame_.name : "world";
  const msg::PointCloud2 cloud =
      cloud_of(scan, point_layout("xyzit"), frame, epoch_, points, kPlainIntensity);
  server_->publish(channel,
                   std::make_shared<const std::vector<std::byte>>(encode<Wire::kCdr>(cloud)),
                   stamp(scan.end));
}

void ViewLink::publish_state(SimTime now, const char* doing) {
  const Clock::time_point wall = Clock::now();
  if (wall - last_state_ < kStateBetween) return;
  last_state_ = wall;
  const double window = std::chrono::duration<double>(wall - last_rate_).count();
  if (window > kRateWindow) {
    real_time_factor_ = to_seconds(now - rate_from_) / window;
    last_rate_ = wall;
    rate_from_ = now;
  }
  if (!server_->has_subscribers(state_)) return;
  json vehicles = json::array();
  for (const Vehicle& vehicle : vehicles_) {
    json v = json::object();
    if (vehicle.state) {
      const StateSample& s = *vehicle.state;
      const RigidBodyState& body = s.state.body;
      v = {{"p", list_of(body.p_world)},
           {"q", list_of(body.T_world_body().rotation)},
           {"v", list_of(body.v_world)},
           {"goal", list_of(s.command.p_world)}};
      if (s.nearest) {
        v["nearest"] = {{"distance", rounded(s.nearest->distance, 1e-3)},
                        {"place", list_of(s.nearest->position_world)},
                        {"label", s.nearest->label}};
      }
      json rotors = json::array();
      for (const RotorState& rotor : s.state.rotors) rotors.push_back(std::round(rotor.speed));
      v["rotors"] = std::move(rotors);
    }
    if (vehicle.status && !vehicle.state) {  // another process flies it
      const RigidBodyState& body = vehicle.status->state;
      v = {{"p", list_of(body.p_world)},
           {"q", list_of(body.T_world_body().rotation)},
           {"v", list_of(body.v_world)}};
    } else if (vehicle.status) {
      const StatusSample& s = *vehicle.status;
      v["command"] = s.command;
      v["collisions"] = s.collisions;
      v["touches"] = s.touches;
      v["crashed"] = s.crashed;
      v["landed"] = s.landed;
      v["scans"] = s.scans;
    }
    vehicles.push_back(std::move(v));
  }
  json obstacles = json::array();
  if (obstacles_) {
    for (const PlacedObstacle& o : obstacles_->obstacles) {
      if (obstacles.size() == kMostObstacles) break;
      const auto* solid = std::get_if<Solid>(&o.shape);
      obstacles.push_back(
          {{"label", o.label},
           {"p", list_of(o.T_world_body.translation)},
           {"q", list_of(o.T_world_body.rotation)},
           {"shape",
            shape_of(solid != nullptr ? *solid : Solid{Sphere{bounding_radius(o.shape)}})}});
    }
  }
  server_->publish(state_,
                   bytes_of({{"t", to_seconds(now)},
                             {"doing", doing},
                             {"rate", rounded(real_time_factor_, 1e-3)},
                             {"vehicles", std::move(vehicles)},
                             {"obstacles", std::move(obstacles)}}),
                   stamp(now));
}

void ViewLink::on_step(const StepDone& step) {
  publish_state(step.time, "running");
}

void ViewLink::on_wait(SimTime now, Waiting why) {
  publish_state(now, why == Waiting::kPaused ? "paused" : "waiting");
}

void ViewLink::on_reset(SimTime reached) {
  epoch_ += reached.time_since_epoch() + std::chrono::seconds(1);
  rate_from_ = SimTime{};
  obstacles_.reset();
  server_->new_session();
}

void ViewLink::on_seek(SimTime to) {
  rate_from_ = to;
  last_rate_ = Clock::now();
  obstacles_.reset();
}

void ViewLink::close() {
  server_->close();
}

}  // namespace pointflight
