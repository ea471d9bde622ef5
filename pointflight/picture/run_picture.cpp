#include "pointflight/picture/run_picture.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace pointflight::picture {

void Track::add(const Vector3d& p) {
  constexpr std::size_t kMost = 2000;
  last_ = p;
  if (!points_.empty() && (points_.back() - p).norm() < apart_) return;
  if (points_.size() == kMost) {
    for (std::size_t i = 0; 2 * i < kMost; ++i) points_[i] = points_[2 * i];
    points_.resize(kMost / 2);
    apart_ *= 2.0;
  }
  points_.push_back(p);
}

std::vector<Vector3d> Track::points() const {
  std::vector<Vector3d> points = points_;
  if (!points.empty() && points.back() != last_) points.push_back(last_);
  return points;
}

void RunPicture::add_path_point(std::size_t vehicle, const Vector3d& p) {
  if (paths.size() <= vehicle) paths.resize(vehicle + 1);
  paths[vehicle].add(p);
}

void RunPicture::add_obstacle(std::uint32_t label, const Vector3d& p, double radius) {
  constexpr double kJump = 2.0;  // m between two samples: another one took its place
  const auto [known, is_new] = trace_of_.try_emplace(label, traces.size());
  if (is_new) traces.push_back({label, radius, {}});
  Trace& trace = traces[known->second];
  if (!is_new && (trace.track.last() - p).norm() > kJump) trace = {label, radius, {}};
  trace.track.add(p);
}

void RunPicture::on_sample(const Sample& sample) {
  std::visit(
      Overloaded{[&](const StateSample& s) {
                   own_.insert(s.vehicle);
                   add_path_point(s.vehicle, s.state.body.p_world);
                 },
                 [&](const StatusSample& s) {  // all that is told of another process' vehicle
                   if (!own_.contains(s.vehicle)) add_path_point(s.vehicle, s.state.p_world);
                 },
                 [&](const ScanSample& s) { add_scan(s); },
                 [&](const CollisionEvent& s) {
                   if (s.entered) collisions.add(s.position_world);
                 },
                 [&](const ObstacleSample& s) {
                   for (const auto& [label, pose, shape] : s.obstacles) {
                     const auto* solid = std::get_if<Solid>(&shape);
                     const Vector3d half =
                         solid != nullptr ? half_extent(*solid) : Vector3d::Zero();
                     add_obstacle(label, pose.translation, std::max(half.x(), half.y()));
                   }
                 },
                 [](const auto&) {}},
      sample);
}

void RunPicture::add_scan(const ScanSample& sample) {
  constexpr std::size_t kMovingStride = 4;  // there are few
  const Scan& scan = *sample.scan;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const ScanPoint& point = scan.points[i];
    const bool moving = point.label != kMapLabel;
    const std::size_t stride = moving ? kMovingStride : kSeenStride;
    if (i % stride != scan.index % stride) continue;
    (moving ? seen_moving : seen)
        .add(sample.T_world_sensor.at(scan.seen_at(point)) * point.position_sensor.cast<double>());
  }
}

void RunFigures::add_closest(std::optional<double> distance) {
  // what was hit is at zero, however deep
  if (distance) closest = std::max(0.0, std::min(closest.value_or(*distance), *distance));
}

void write_titles(const RunFigures& f, RunPicture& picture) {
  const std::string who =
      f.others > 0     ? fmt::format("{} of {} vehicles, ", f.vehicles, f.vehicles + f.others)
      : f.vehicles > 1 ? fmt::format("{} vehicles, ", f.vehicles)
                       : std::string();
  picture.title = fmt::format("{}{:.1f} m flown in {:.1f} s, {}", who, f.flown, f.time, f.end);
  picture.subtitle =
      fmt::format("{} scan{}, {:.2f} M points; closest approach {}; {} collision{}",
                  f.scans,
                  f.scans == 1 ? "" : "s",
                  static_cast<double>(f.points) * 1e-6,
                  f.closest ? fmt::format("{:.2f} m", *f.closest) : std::string("over 10 m"),
                  f.collisions,
                  f.collisions == 1 ? "" : "s");
}

void describe_run(const Simulation& simulation, RunPicture& picture) {
  RunFigures figures;
  figures.vehicles = simulation.flying_here().size();
  figures.others = simulation.vehicle_count() - figures.vehicles;
  figures.time = to_seconds(simulation.time());
  figures.end = to_string(simulation.end());
  picture.waypoints.clear();
  picture.names.clear();
  for (std::size_t v = 0; v < simulation.vehicle_count(); ++v) {
    const VehicleSummary& s = simulation.summary(v);
    figures.flown += s.distance_flown;
    figures.scans += s.scans;
    figures.points += s.points;
    figures.collisions += s.collisions;
    figures.add_closest(s.closest_approach);
    picture.waypoints.push_back(simulation.vehicle(v).setup().mission.waypoints);
    picture.names.push_back(simulation.vehicle(v).setup().name);
  }
  write_titles(figures, picture);
}

}  // namespace pointflight::picture
