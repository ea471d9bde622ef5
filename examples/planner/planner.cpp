#include "examples/planner/planner.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

#include "pointflight/core/constants.hpp"

namespace planner {
namespace {

using pointflight::BSplineTrajectory;
using pointflight::PositionCommand;
using pointflight::Trajectory;

constexpr double kMargin = 0.25;  // m beyond the hull that paths use only if there is no other way
constexpr double kTight = 0.02;   // m that no path may use
constexpr double kComfort = 1.2;  // m from which on room costs nothing
constexpr double kLookAhead = 2.5;  // s for which movers are foreseen
constexpr double kInterval = 0.25;  // s between knots
constexpr double kHorizon = 8.0;    // m of path that is flown at once
constexpr double kBlind = 0.3;      // m below the vehicle it flies only where it has seen
constexpr std::size_t kNodesMax = 120000;

/// Steps from a cell to the 26 around it.
std::vector<Eigen::Vector3i> neighbours() {
  std::vector<Eigen::Vector3i> steps;
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        if (x != 0 || y != 0 || z != 0) steps.emplace_back(x, y, z);
      }
    }
  }
  return steps;
}

bool is_inside(const pointflight::Aabb& box, const Vector3d& p) {
  return (p - box.min).minCoeff() >= 0.0 && (box.max - p).minCoeff() >= 0.0;
}

}  // namespace

/// Distance of the hull to what stands still and to where movers will be.
double Planner::room_at(const Vector3d& p, double time, double ahead) const {
  return room_with(map_.distance(p), p, time, ahead);
}

/// Given the distance to what stands still.
double Planner::room_with(double distance, const Vector3d& p, double time, double ahead) const {
  // a point of a filled cell lies up to half a cell from its centre, most of them less
  double room = distance - 0.3 * LocalMap::kCell;
  for (const Mover& mover : map_.movers()) {
    const double foreseen = time + std::min(ahead, kLookAhead);
    const double unsure = 0.15 * std::min(ahead, kLookAhead);
    room = std::min(room, (p - mover.at(foreseen)).norm() - mover.radius - 0.2 - unsure);
  }
  return room - options_.radius;
}

double Planner::room(const Trajectory& trajectory, double time, double skip) const {
  double least = std::numeric_limits<double>::infinity();
  // and while it then rests
  const double end = std::max(trajectory.duration(), skip) + 2.0;
  for (double t = skip; t < end; t += 0.1) {
    const Vector3d p = trajectory.at(t).p_world;
    least = std::min(least, room_with(map_.distance_between(p), p, time, t - skip));
  }
  return least;
}

void Planner::fly_to(const Vector3d& goal) {
  goal_ = goal;
  learned_.clear();  // what was far from one goal may be near another
}

double Planner::left(const Vector3d& p) const {
  const auto known = learned_.find(LocalMap::key_of(p));
  const double straight = (goal_ - p).norm();
  return known == learned_.end() ? straight
                                 : std::max(straight, static_cast<double>(known->second));
}

/// From each cell that was searched it is as far to the goal as from where the search ended, less
/// the way there (real-time adaptive A*: Koenig and Likhachev 2006).
void Planner::learn(const std::vector<std::size_t>& visited,
                    const std::vector<float>& cost,
                    double estimate) {
  for (const std::size_t cell : visited) {
    const Vector3d p = map_.center_of(cell);
    const double least = estimate - static_cast<double>(cost[cell]);
    if (least <= left(p)) continue;
    learned_[LocalMap::key_of(p)] = static_cast<float>(least);
  }
}

/// A* over cells towards the goal, or to the best position within the horizon.
std::vector<Vector3d> Planner::search(const Vector3d& from, double time) {
  struct Open {
    double estimate;
    std::size_t cell;
    bool operator<(const Open& o) const { return estimate > o.estimate; }
  };
  if (!map_.contains(from)) return {};
  std::vector<float> cost(map_.size(), std::numeric_limits<float>::infinity());
  std::vector<std::uint32_t> parent(map_.size(), 0);
  std::priority_queue<Open> open;
  const std::size_t start = map_.index_of(from);
  cost[start] = 0.0f;
  parent[start] = static_cast<std::uint32_t>(start);
  open.push({left(map_.center_of(start)), start});
  std::size_t best = start;
  double best_score = left(from);
  std::vector<std::size_t> visited;
  std::optional<double> estimate;  // of the whole way
  const auto around = neighbours();
  while (!open.empty() && visited.size() < kNodesMax) {
    const Open node = open.top();
    open.pop();
    const Vector3d p = map_.center_of(node.cell);
    const double so_far = static_cast<double>(cost[node.cell]);
    if (node.estimate > so_far + left(p) + 1e-3) continue;
    const double away = (p - from).norm();
    visited.push_back(node.cell);
    if ((goal_ - p).norm() < LocalMap::kCell) {
      best = node.cell;
      break;
    }
    // should there be no way out: the position that promises most
    const double score = left(p) + 0.3 * so_far;
    if (score < best_score) {
      best_score = score;
      best = node.cell;
    }
    // nothing within the horizon leads to the goal sooner than what leaves it here
    if (away > kHorizon + 1.0) {
      best = node.cell;
      estimate = node.estimate;
      break;
    }
    for (const Eigen::Vector3i& d : around) {
      const Vector3d q = p + LocalMap::kCell * d.cast<double>();
      if (!map_.contains(q) || !is_inside(options_.fence, q)) continue;
      if (q.z() < from.z() - kBlind && !map_.is_known(q)) continue;
      const double room = room_at(q, time, away / options_.speed);
      // out of a tight position any way is good that leads to more room
      if (room < kTight && room <= room_at(p, time, away / options_.speed)) continue;
      const double tight = std::clamp((kComfort - room) / kComfort, 0.0, 1.5);
      const double narrow = std::max(0.0, 1.0 - room / kMargin);
      const double step = LocalMap::kCell *
                          std::sqrt(d.x() * d.x() + d.y() * d.y() + 4.0 * d.z() * d.z()) *
                          (1.0 + 6.0 * tight * tight + 20.0 * narrow);
      const std::size_t to = map_.index_of(q);
      const auto total = static_cast<float>(so_far + step);
      if (total >= cost[to]) continue;
      cost[to] = total;
      parent[to] = static_cast<std::uint32_t>(node.cell);
      open.push({static_cast<double>(total) + left(q), to});
    }
  }
  if (estimate) learn(visited, cost, *estimate);
  std::vector<Vector3d> path;
  for (std::size_t at = best; at != start; at = parent[at]) path.push_back(map_.center_of(at));
  path.push_back(from);
  std::reverse(path.begin(), path.end());
  if ((path.back() - goal_).norm() < LocalMap::kCell) path.back() = goal_;
  return path;
}

/// Leaves out what a straight line can do as well.
std::vector<Vector3d> Planner::shortened(const std::vector<Vector3d>& path, double time) const {
  std::vector<Vector3d> kept = {path.front()};
  const auto as_good = [&](std::size_t from, std::size_t to) {
    double needed = std::numeric_limits<double>::infinity();
    for (std::size_t i = from; i <= to; ++i) {
      const double ahead = (path[i] - path.front()).norm() / options_.speed;
      needed = std::min(needed, room_at(path[i], time, ahead));
    }
    needed = std::min(needed - 0.05, 0.8);
    const Vector3d way = path[to] - path[from];
    const int steps = static_cast<int>(way.norm() / 0.1) + 1;
    for (int i = 0; i <= steps; ++i) {
      const Vector3d p = path[from] + way * (static_cast<double>(i) / steps);
      if (room_at(p, time, (p - path.front()).norm() / options_.speed) < needed) return false;
    }
    return true;
  };
  for (std::size_t at = 0; at + 1 < path.size();) {
    std::size_t next = at + 1;
    while (next + 1 < path.size() && next - at < 24 && as_good(at, next + 1)) ++next;
    kept.push_back(path[next]);
    at = next;
  }
  return kept;
}

/// Control points a knot interval apart along the path, the first three from the present motion, at
/// rest in the end.
std::shared_ptr<const Trajectory> Planner::spline(const std::vector<Vector3d>& path,
                                                  const PositionCommand& now,
                                                  double speed) const {
  const double dt = kInterval;
  const auto point = [](const Vector3d& p, double yaw) {
    return Eigen::Vector4d(p.x(), p.y(), p.z(), yaw);
  };
  std::vector<Eigen::Vector4d> points;
  const Vector3d& a = now.a_world;
  points.push_back(point(now.p_world - dt * now.v_world + dt * dt / 3.0 * a, now.yaw));
  points.push_back(point(now.p_world - dt * dt / 6.0 * a, now.yaw));
  points.push_back(point(now.p_world + dt * now.v_world + dt * dt / 3.0 * a, now.yaw));

  // where the path goes on from the third of them
  const Vector3d third = points.back().head<3>();
  double length = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) length += (path[i] - path[i - 1]).norm();
  length = std::min(length, kHorizon);
  const auto on_path = [&](double s) {
    for (std::size_t i = 1; i < path.size(); ++i) {
      const double leg = (path[i] - path[i - 1]).norm();
      if (s <= leg && leg > 0.0) {
        return Vector3d(path[i - 1] + (s / leg) * (path[i] - path[i - 1]));
      }
      s -= leg;
    }
    return path.back();
  };
  double at = std::min(length, (third - path.front()).norm());
  double pace = std::clamp(now.v_world.norm(), 0.2, speed);
  double yaw = now.yaw;
  for (int i = 0; i < 200 && at < length - 0.05; ++i) {
    const double stoppable = std::sqrt(2.0 * options_.acceleration * std::max(0.0, length - at));
    pace = std::min({pace + options_.acceleration * dt, speed, std::max(0.3, stoppable)});
    at = std::min(length, at + pace * dt);
    const Vector3d p = on_path(at);
    // look ahead, turning no faster than 1.5 rad/s
    const Vector3d way = p - points.back().head<3>();
    if (std::hypot(way.x(), way.y()) > 0.05) {
      const double wanted = std::atan2(way.y(), way.x());
      const double turn = std::remainder(wanted - yaw, 2.0 * pointflight::kPi);
      yaw += std::clamp(turn, -1.5 * dt, 1.5 * dt);
    }
    points.push_back(point(p, yaw));
  }
  for (int i = 0; i < 3; ++i) points.push_back(points.back());
  return BSplineTrajectory::uniform(std::move(points), 3, dt);
}

/// No way ahead: a short move to where there is most room.
std::shared_ptr<const Trajectory> Planner::escape(const PositionCommand& now, double time) const {
  std::shared_ptr<const Trajectory> best;
  double most = -std::numeric_limits<double>::infinity();
  for (const double reach : {0.0, 0.6, 1.2, 2.0}) {
    for (int i = 0; i < (reach > 0.0 ? 16 : 1); ++i) {
      const double angle = 2.0 * pointflight::kPi * i / 16.0;
      const Vector3d to =
          now.p_world + 0.3 * now.v_world + reach * Vector3d(std::cos(angle), std::sin(angle), 0.0);
      auto move = spline({now.p_world, to}, now, 1.5 * options_.speed);
      const double r = room(*move, time, 0.0);
      if (r > most) {
        most = r;
        best = std::move(move);
      }
    }
  }
  return best;
}

std::shared_ptr<const Trajectory> Planner::update(const std::vector<SeenPoint>& points,
                                                  const PositionCommand& now,
                                                  double time) {
  map_.add_scan(points, now.p_world, time);
  if ((now.p_world - goal_).norm() < 0.2 && now.v_world.norm() < 0.1) return nullptr;
  const std::vector<Vector3d> found = search(now.p_world, time);
  std::shared_ptr<const Trajectory> chosen;
  double chosen_room = -std::numeric_limits<double>::infinity();
  if (found.size() > 1) {
    const std::vector<Vector3d> path = shortened(found, time);
    for (const double share : {1.0, 0.6, 0.35, 0.2}) {
      auto trajectory = spline(path, now, share * options_.speed);
      const double r = room(*trajectory, time, 0.0);
      if (r > chosen_room) {
        chosen_room = r;
        chosen = std::move(trajectory);
      }
      if (chosen_room > 0.6 * kMargin) break;
    }
  }
  // what is flown may be better than what is new; at rest anywhere there is room, and no way ahead
  const double flown_for = time - flown_since_;
  const double enough = flown_ && flown_for < flown_->duration() ? 0.6 * kMargin : kTight;
  if (flown_ && chosen_room < enough) {
    const double r = room(*flown_, time, flown_for);
    if (r > chosen_room) {
      chosen_room = r;
      chosen = nullptr;
    }
  }
  if (chosen_room < kTight) {
    auto move = escape(now, time);
    if (move && room(*move, time, 0.0) > chosen_room) chosen = std::move(move);
  }
  if (chosen) {
    flown_ = chosen;
    flown_since_ = time;
  }
  return chosen;
}

}  // namespace planner
