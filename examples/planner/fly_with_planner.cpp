// Flies a drone through a map by what its LiDARs see, among moving obstacles: the planner of this
// folder in the loop with the simulation, through the public interface only.
//
//   fly_with_planner MAP.pfmap -o RUN [--force] [--seed N] [--seeds N] [--obstacles N] [--threads
//   N] fly_with_planner SCENARIO.yaml -o RUN [--route] [--fence x,y,z,x,y,z]
//   [--threads N]
//
// A scenario's first vehicle is flown to its last waypoint, with the scenario's own seed: as a
// campaign's command (docs/campaigns.md). With --route it flies by the others as well: a way
// through a building that somebody else has found.
//
// With --seeds N it flies the seeds 1 .. N and says for each how it went; a seed that fails prints
// the command that replays it. Exit code 0: all arrived without a collision.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "examples/planner/planner.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/sim/flight_recorder.hpp"
#include "pointflight/sim/simulation.hpp"
#include "pointflight/sim/start_check.hpp"

using namespace pointflight;

namespace {

struct Options {
  std::string map;
  std::string output;
  Existing existing = Existing::kRefuse;  ///< --force: an earlier run is replaced.
  int seed = 1;
  int seeds = 0;  ///< Above 0: these many, from 1 on.
  int obstacles = 40;
  int threads = 0;
  bool is_route = false;
  std::optional<Aabb> fence;  ///< That a scenario's vehicle does not leave; else the map's box.
};

constexpr double kLow = 1.4;  // m: the layer in which drone and obstacles fly
constexpr double kHigh = 3.2;
constexpr double kUnder = 0.9;   // m under start and goal that a scenario's vehicle may fly
constexpr double kOver = 1.5;    // and over
constexpr double kPassed = 0.7;  // m from a waypoint, on to the next

/// Collects what a scan saw, in the world, and passes everything on to the recorder.
class Eyes : public SampleSink {
 public:
  explicit Eyes(FlightRecorder* recorder) : recorder_(recorder) {}

  void on_sample(const Sample& sample) override {
    if (recorder_ != nullptr) recorder_->on_sample(sample);
    if (const auto* scanned = std::get_if<ScanSample>(&sample)) look_at(*scanned);
    if (const auto* event = std::get_if<CollisionEvent>(&sample)) say(*event);
  }

  std::vector<planner::SeenPoint> seen;

 private:
  void look_at(const ScanSample& sample) {
    for (const ScanPoint& point : sample.scan->points) {
      const Pose T_world_sensor = sample.T_world_sensor.at(sample.scan->seen_at(point));
      seen.push_back(
          {T_world_sensor.translation, T_world_sensor * point.position_sensor.cast<double>()});
    }
  }
  static void say(const CollisionEvent& event) {
    if (!event.entered) return;
    std::fprintf(stderr,
                 "  collision at %.2f s with %s at (%.2f, %.2f, %.2f)\n",
                 to_seconds(event.time),
                 event.partner == kMapLabel ? "the map" : "an obstacle",
                 event.position_world.x(),
                 event.position_world.y(),
                 event.position_world.z());
  }

  FlightRecorder* recorder_;
};

/// A free position near x, y in the flight layer.
Vector3d free_position(const SurfelMap& map, double x, double y, const RandomStream& random) {
  for (std::uint64_t i = 0; i < 2000; ++i) {
    const double spread = 0.5 + 0.002 * static_cast<double>(i);
    const auto [u, v] = random.uniform2(i);
    const Vector3d p(x + spread * (2 * u - 1), y + spread * (2 * v - 1), 2.2);
    if (!map.nearest(p, 1.2)) return p;
  }
  throw InputError("no free place was found for start and goal; give a map with more room");
}

Scenario scenario_for(const Options& options, const SurfelMap& map, int seed, Vector3d& goal) {
  const Aabb& box = map.bounds_world();
  const RandomStream random(static_cast<std::uint64_t>(seed), StreamId::kMissionSearch, 0);
  const RandomStream places(static_cast<std::uint64_t>(seed), StreamId::kMissionSearch, 1);
  const auto along = [&](double share) { return box.min.x() + share * box.size().x(); };
  const auto across = [&](std::uint64_t i) {
    return box.min.y() + random.uniform(i, 0.2, 0.8) * box.size().y();
  };
  Scenario s;
  s.map = options.map;
  s.seed = seed;
  s.duration = 120.0;
  VehicleSetup& drone = s.vehicles.front();
  drone.start = free_position(map, along(0.08), across(0), places);
  goal = free_position(map, along(0.92), across(1), random);
  // one looks up, one down: a Mid-360 alone is blind for what comes from below
  LidarMount up;
  LidarMount down;
  down.position = {0, 0, -0.1};
  down.rotation_rpy_deg = {180, 0, 0};
  drone.lidars = {up, down};
  ObstacleSettings balls;
  balls.count = options.obstacles;
  balls.size.radius = 0.25;
  balls.radius_max = 0.5;
  balls.speed = 0.3;
  balls.speed_max = 1.0;
  balls.directions = FlightDirections::kHorizontal;
  balls.at_border = AtBorder::kBounce;  // one that appears out of nothing is nobody's fault
  balls.bounds_min = {box.min.x(), box.min.y(), kLow};
  balls.bounds_max = {box.max.x(), box.max.y(), kHigh};
  if (options.obstacles > 0) s.obstacles = {balls};
  return s;
}

/// A scenario of somebody else's, whose mission only says where to: by which positions, if
/// `is_route`.
Scenario scenario_from(const std::string& path, bool is_route, std::vector<Vector3d>& goals) {
  Scenario s = load_scenario(path);
  require_own_autopilots(s);
  MissionSettings& mission = s.vehicles.front().mission;
  if (mission.waypoints.empty()) {
    throw InputError(path + ": mission.waypoints: names no place to fly to");
  }
  goals = std::move(mission.waypoints);
  if (!is_route) goals = {goals.back()};
  mission.waypoints.clear();
  double way = 0.0;
  Vector3d from = s.vehicles.front().start;
  for (const Vector3d& to : goals) {
    way += (to - from).norm();
    from = to;
  }
  if (s.duration <= 0.0) s.duration = std::max(120.0, 5.0 * way / mission.motion.speed);
  return s;
}

struct Outcome {
  bool arrived = false;
  std::uint64_t collisions = 0;
  double time = 0.0;
  double flown = 0.0;
  double closest = 0.0;
  double planning_ms = 0.0;  ///< The longest of all updates.
};

Outcome fly(const Scenario& scenario,
            const std::vector<Vector3d>& goals,
            const std::shared_ptr<const SurfelMap>& map,
            const Aabb& fence,
            const std::string& output,
            Existing existing,
            const Executor& executor) {
  Simulation simulation(scenario, map, executor);
  std::unique_ptr<FlightRecorder> recorder;
  if (!output.empty()) recorder = std::make_unique<FlightRecorder>(output, simulation, existing);
  Eyes eyes(recorder.get());
  planner::PlannerOptions planning;
  planning.fence = fence;
  planning.speed = scenario.vehicles.front().mission.motion.speed;
  planner::Planner planner(planning, goals.front());
  std::size_t goal = 0;
  Outcome outcome;
  // with every scan, a little after its last beam
  for (int scan = 1;; ++scan) {
    const SimTime due{std::chrono::milliseconds(100 * scan + 5)};
    if (!simulation.advance_to(due, eyes)) break;
    const auto start = std::chrono::steady_clock::now();
    const PositionCommand& now = simulation.status(0).autopilot.reference;
    const auto trajectory = planner.update(eyes.seen, now, to_seconds(simulation.time()));
    eyes.seen.clear();
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    outcome.planning_ms = std::max(outcome.planning_ms, 1e3 * took.count());
    if (trajectory) simulation.command(0, TrajectoryCommand{trajectory});
    const RigidBodyState& body = simulation.status(0).state.body;
    const auto away = [&](std::size_t i) { return (body.p_world - goals[i]).norm(); };
    while (goal + 1 < goals.size() && (away(goal) < kPassed || away(goal + 1) < away(goal))) {
      planner.fly_to(goals[++goal]);
    }
    if ((body.p_world - goals.back()).norm() < 0.4) {
      outcome.arrived = true;
      simulation.complete();
      break;
    }
  }
  if (recorder) recorder->finish(simulation);
  const VehicleSummary& summary = simulation.summary(0);
  outcome.collisions = summary.collisions;
  outcome.time = to_seconds(simulation.time());
  outcome.flown = summary.distance_flown;
  outcome.closest = summary.closest_approach.value_or(10.0);
  return outcome;
}

/// "0,0,0,10,10,5"
Aabb box_of(const std::string& text) {
  std::array<double, 6> v{};
  const char format[] = "%lf,%lf,%lf,%lf,%lf,%lf";
  if (std::sscanf(text.c_str(), format, &v[0], &v[1], &v[2], &v[3], &v[4], &v[5]) != 6) {
    throw InputError("--fence: '" + text + "'; x,y,z,x,y,z of two corners, m");
  }
  Aabb box;
  box.add({v[0], v[1], v[2]});
  box.add({v[3], v[4], v[5]});
  return box;
}

Options parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string flag = argv[i];
    const auto value = [&]() -> std::string {
      if (i + 1 >= argc) throw InputError(flag + ": a value is missing");
      return argv[++i];
    };
    const auto number = [&] {
      const std::string text = value();
      char* end = nullptr;
      const long parsed = std::strtol(text.c_str(), &end, 10);
      if (end == text.c_str() || *end != '\0' || parsed < 0 || parsed > 100000) {
        throw InputError(flag + ": '" + text + "'; a whole number, not negative");
      }
      return static_cast<int>(parsed);
    };
    if (flag == "-o") {
      options.output = value();
    } else if (flag == "--force") {
      options.existing = Existing::kReplace;
    } else if (flag == "--seed") {
      options.seed = number();
    } else if (flag == "--seeds") {
      options.seeds = number();
    } else if (flag == "--obstacles") {
      options.obstacles = number();
    } else if (flag == "--route") {
      options.is_route = true;
    } else if (flag == "--fence") {
      options.fence = box_of(value());
    } else if (flag == "--threads") {
      options.threads = number();
    } else if (options.map.empty() && flag.front() != '-') {
      options.map = flag;
    } else {
      throw InputError(flag + ": unknown; see the top of fly_with_planner.cpp");
    }
  }
  if (options.map.empty()) {
    throw InputError(
        "usage: fly_with_planner MAP.pfmap -o RUN [--force] [--seed N] [--seeds N] [--obstacles "
        "N]");
  }
  return options;
}

/// A line about it; true if it arrived without a collision.
bool say(std::int64_t seed, const Outcome& o) {
  std::printf(
      "seed %lld: %s, %.1f m in %.1f s, closest %.2f m, %llu collision%s, a plan in %.0f ms at "
      "most\n",
      static_cast<long long>(seed),
      o.arrived ? "arrived" : "did not arrive",
      o.flown,
      o.time,
      o.closest,
      static_cast<unsigned long long>(o.collisions),
      o.collisions == 1 ? "" : "s",
      o.planning_ms);
  std::fflush(stdout);
  return o.arrived && o.collisions == 0;
}

int fly_scenario(const Options& options, const Executor& executor) {
  std::vector<Vector3d> goals;
  const Scenario scenario = scenario_from(options.map, options.is_route, goals);
  const auto map = scenario.open_map();
  Aabb fence = options.fence.value_or(map->bounds_world());
  Aabb flown;
  flown.add(scenario.vehicles.front().start);
  for (const Vector3d& goal : goals) flown.add(goal);
  fence.min.z() = std::max(fence.min.z(), flown.min.z() - kUnder);
  fence.max.z() = std::min(fence.max.z(), flown.max.z() + kOver);
  const Outcome outcome =
      fly(scenario, goals, map, fence, options.output, options.existing, executor);
  return say(scenario.seed, outcome) ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) try {
  const Options options = parse(argc, argv);
  const Executor executor(options.threads);
  if (options.map.ends_with(".yaml")) return fly_scenario(options, executor);
  const auto map = SurfelMap::open(options.map);
  int failed = 0;
  const int first = options.seeds > 0 ? 1 : options.seed;
  const int last = options.seeds > 0 ? options.seeds : options.seed;
  for (int seed = first; seed <= last; ++seed) {
    // of many seeds only those that fail are worth their files: replay them
    const std::string output = options.seeds > 0 ? std::string() : options.output;
    Vector3d goal;
    const Scenario scenario = scenario_for(options, *map, seed, goal);
    Aabb fence = map->bounds_world();
    fence.min.z() = kLow;
    fence.max.z() = kHigh;
    if (say(seed, fly(scenario, {goal}, map, fence, output, options.existing, executor))) continue;
    ++failed;
    std::printf("  replay: %s %s -o replay_%d --seed %d --obstacles %d\n",
                argv[0],
                options.map.c_str(),
                seed,
                seed,
                options.obstacles);
  }
  return failed == 0 ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "fly_with_planner: %s\n", error.what());
  return 2;
}
