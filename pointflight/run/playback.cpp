#include "pointflight/run/playback.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <tuple>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/io/csv_table.hpp"
#include "pointflight/run/run_loop.hpp"

namespace pointflight {
namespace {

namespace fs = std::filesystem;

SimTime time_at(const CsvTable& table, std::size_t row, int column) {
  return SimTime(from_seconds(table.at(row, column)));
}

Vector3d vector_at(const CsvTable& table, std::size_t row, int column) {
  return {table.at(row, column), table.at(row, column + 1), table.at(row, column + 2)};
}

/// w, x, y, z from a column on.
Quaterniond rotation_at(const CsvTable& table, std::size_t row, int column) {
  return {table.at(row, column),
          table.at(row, column + 1),
          table.at(row, column + 2),
          table.at(row, column + 3)};
}

/// px ... wz from a column on.
RigidBodyState body_at(const CsvTable& table, std::size_t row, int column) {
  RigidBodyState body;
  body.p_world = vector_at(table, row, column);
  body.q_world_body = rotation_at(table, row, column + 3);
  body.v_world = vector_at(table, row, column + 7);
  body.omega_body = vector_at(table, row, column + 10);
  return body;
}

/// Lines of a file as words between commas, without the first line.
std::vector<std::vector<std::string>> words_of(const std::string& path) {
  std::ifstream file(path);
  std::vector<std::vector<std::string>> rows;
  std::string line;
  for (std::getline(file, line); std::getline(file, line);) {
    std::vector<std::string>& words = rows.emplace_back(1);
    for (const char c : line) {
      if (c == ',') {
        words.emplace_back();
      } else {
        words.back() += c;
      }
    }
  }
  return rows;
}

/// What summary.json says.
SimTime ended_at(const fs::path& path) {
  std::ifstream file(path);
  const auto json = nlohmann::json::parse(file, nullptr, false);
  if (!json.is_object() || !json.contains("simulated_time") ||
      !json["simulated_time"].is_number()) {
    throw InputError(fmt::format("{}: is missing or no summary of a run", path.string()));
  }
  return SimTime(from_seconds(json["simulated_time"].get<double>()));
}

double number(const std::string& word) {
  return word.empty() ? 0.0 : std::strtod(word.c_str(), nullptr);
}

}  // namespace

struct RecordedRun::Files {
  /// One sample of the run, made when its turn comes.
  struct Entry {
    std::int64_t step;    ///< That it came in.
    int phase;            ///< 0: vehicles' samples; 1: obstacles; 2: scans.
    SimTime time;         ///< When it arrived.
    std::size_t rank;     ///< Among those of one instant.
    std::size_t vehicle;  ///< Number in the fleet.
    std::function<Sample()> make;
  };

  Files(const std::string& folder, const Executor& with)
      : executor(with),
        scenario(load_scenario((fs::path(folder) / "scenario.yaml").string())),
        simulation(scenario, scenario.open_map(), executor),
        description(describe_run(simulation)),
        step(from_seconds(scenario.physics_step)),
        end(ended_at(fs::path(folder) / "summary.json")) {
    for (std::size_t v = 0; v < simulation.vehicle_count(); ++v) {
      const fs::path own = fs::path(folder) / description.vehicles[v].setup.name;
      add_vehicle(v, simulation.vehicle_count() == 1 ? fs::path(folder) : own);
    }
    add_events((fs::path(folder) / "events.csv").string());
    const fs::path obstacles = fs::path(folder) / "obstacles.csv";
    if (fs::exists(obstacles)) add_obstacles(obstacles.string());
    std::stable_sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
      return std::tie(a.step, a.phase, a.time, a.rank, a.vehicle) <
             std::tie(b.step, b.phase, b.time, b.rank, b.vehicle);
    });
  }

  /// `early`: it came in the step that its time lies in; else in the first one after.
  void add(int phase,
           SimTime time,
           std::size_t rank,
           std::size_t vehicle,
           bool early,
           std::function<Sample()> make) {
    const Duration since = time.time_since_epoch();
    const std::int64_t number = early ? since / step : (since + step - Duration{1}) / step;
    entries.push_back({number, phase, time, rank, vehicle, std::move(make)});
  }

  void add_vehicle(std::size_t v, const fs::path& folder) {
    add_states(v, folder / "trajectory.csv");
    if (fs::exists(folder / "odometry.csv")) add_odometry(v, folder / "odometry.csv");
    if (fs::exists(folder / "imu.csv")) add_imu(v, folder / "imu.csv");
    const auto sensors = simulation.vehicle(v).sensors();
    std::map<std::string, int> alike;
    for (std::size_t i = 0; i < sensors.size(); ++i) {
      if (sensors[i].kind == nullptr) continue;
      const int before = alike[sensors[i].kind->name]++;
      const std::string name = sensors[i].kind->name;
      add_sensor(
          v, i, folder / (before == 0 ? name + ".csv" : fmt::format("{}_{}.csv", name, before)));
    }
    add_scans(v, folder);
  }

  const CsvTable& table(const fs::path& path) { return tables.emplace_back(path.string()); }

  /// Samples of a vehicle, one per row, that came at the time in a column.
  template <class Make>
  void add_rows(const CsvTable& t, int column, std::size_t rank, std::size_t v, const Make& make) {
    for (std::size_t row = 0; row < t.rows(); ++row) {
      add(0, time_at(t, row, column), rank, v, true, [make, row] { return Sample(make(row)); });
    }
  }

  void add_states(std::size_t v, const fs::path& path) {
    const CsvTable& t = table(path);
    const int clearance = t.require("clearance");
    const int rotor = t.find("rotor0");
    const std::size_t rotors = simulation.status(v).state.rotors.size();
    std::vector<TimedPose> poses;
    for (std::size_t row = 0; row < t.rows(); ++row) {
      const SimTime time = time_at(t, row, 0);
      if (!poses.empty() && time <= poses.back().time) {
        throw InputError(fmt::format("{}: times must ascend", t.place(row)));
      }
      poses.push_back({time, body_at(t, row, 1).T_world_body()});
    }
    tracks.emplace_back(std::move(poses));
    add_rows(t, 0, kStateRank, v, [&t, v, clearance, rotor, rotors](std::size_t row) {
      StateSample sample;
      sample.vehicle = static_cast<std::uint32_t>(v);
      sample.time = time_at(t, row, 0);
      sample.state.body = body_at(t, row, 1);
      sample.command.p_world = vector_at(t, row, 14);
      if (const double distance = t.at(row, clearance); !std::isnan(distance)) {
        sample.nearest = Contact{distance, {}, static_cast<Label>(t.at(row, clearance + 1))};
      }
      sample.state.rotors.resize(rotors);
      for (std::size_t i = 0; i < rotors && rotor >= 0; ++i) {
        sample.state.rotors[i].speed = t.at(row, rotor + static_cast<int>(i));
      }
      return sample;
    });
  }

  void add_odometry(std::size_t v, const fs::path& path) {
    const CsvTable& t = table(path);
    add_rows(t, 1, kSensorRank, v, [&t, v](std::size_t row) {
      OdometrySample sample;
      sample.vehicle = static_cast<std::uint32_t>(v);
      sample.time = time_at(t, row, 0);
      sample.delivered = time_at(t, row, 1);
      sample.state = body_at(t, row, 2);
      return sample;
    });
  }

  void add_imu(std::size_t v, const fs::path& path) {
    const CsvTable& t = table(path);
    const Vector3d rpy = description.vehicles[v].settings.imu.rotation_rpy_deg * kDegree;
    const Quaterniond q_body_imu = quaternion_from_rpy(rpy.x(), rpy.y(), rpy.z());
    add_rows(t, 0, kSensorRank + 1, v, [this, &t, v, q_body_imu](std::size_t row) {
      ImuSample sample;
      sample.vehicle = static_cast<std::uint32_t>(v);
      sample.time = time_at(t, row, 0);
      sample.gyro = vector_at(t, row, 1);
      sample.accel = vector_at(t, row, 4);
      sample.q_world_imu = rotation_of(v, sample.time) * q_body_imu;
      return sample;
    });
  }

  /// As it was written, where a state was.
  [[nodiscard]] Quaterniond rotation_of(std::size_t v, SimTime time) const {
    const auto records = tracks[v].records();
    const auto at =
        std::lower_bound(records.begin(), records.end(), time, [](const TimedPose& r, SimTime t) {
          return r.time < t;
        });
    const bool written = at != records.end() && at->time == time;
    return written ? at->pose.rotation : tracks[v].at(time).rotation;
  }

  void add_sensor(std::size_t v, std::size_t sensor, const fs::path& path) {
    const CsvTable& t = table(path);
    const std::size_t values = simulation.vehicle(v).sensors()[sensor].kind->columns.size();
    add_rows(t, 1, kSensorRank + sensor, v, [&t, v, sensor, values](std::size_t row) {
      Measurement sample;
      sample.vehicle = static_cast<std::uint32_t>(v);
      sample.sensor = static_cast<std::uint32_t>(sensor);
      sample.time = time_at(t, row, 0);
      sample.delivered = time_at(t, row, 1);
      for (std::size_t i = 0; i < values; ++i) {
        sample.values.push_back(t.at(row, 2 + static_cast<int>(i)));
      }
      return sample;
    });
  }

  void add_scans(std::size_t v, const fs::path& folder) {
    for (const auto& words : words_of((folder / "scans.csv").string())) {
      if (words.size() < 14) continue;
      Scan scan;
      scan.vehicle = static_cast<std::uint32_t>(v);
      scan.sensor = static_cast<std::uint32_t>(number(words[1]));
      scan.index = static_cast<std::uint64_t>(number(words[2]));
      scan.start = SimTime(from_seconds(number(words[3])));
      scan.end = SimTime(from_seconds(number(words[4])));
      scan.beams = static_cast<std::size_t>(number(words[5]));
      const std::string path = (folder / words[0]).string();
      add(2, scan.end, scan.sensor, v, false, [this, scan, path] {
        return with_points(scan, path);
      });
    }
  }

  [[nodiscard]] Sample with_points(Scan scan, const std::string& path) const {
    const VehicleAgent& agent = simulation.vehicle(scan.vehicle);
    if (scan.sensor >= agent.lidars().size()) {
      throw InputError(fmt::format("{}: the scenario has no such lidar", path));
    }
    const MountedLidar& mounted = *agent.lidars()[scan.sensor];
    const std::vector<Beam> beams = mounted.lidar().beams(scan.index, executor);
    scan.snapshot = mounted.takes_snapshots();
    scan.middle = mounted.lidar().middle_of(scan.start, beams, scan.snapshot);
    scan.points = read_scan_points(path, beams);
    return ScanSample{std::make_shared<const Scan>(scan),
                      tracks[scan.vehicle].with_mount(mounted.T_body_sensor())};
  }

  void add_events(const std::string& path) {
    std::map<std::string, Label> labels = {{"map", kMapLabel}};
    for (std::size_t v = 0; v < simulation.vehicle_count(); ++v) {
      labels[description.vehicles[v].setup.name] = simulation.vehicle(v).label();
    }
    for (const auto& words : words_of(path)) {
      if (words.size() < 11 || !labels.contains(words[2])) continue;
      const SimTime time(from_seconds(number(words[0])));
      const std::size_t v = labels[words[2]] - kFirstVehicle;
      const Vector3d here(number(words[4]), number(words[5]), number(words[6]));
      if (!words[1].starts_with("collision")) {
        add(0, time, kEventRank, v, false, [=, kind = words[1]] {
          return Sample(VehicleEvent{static_cast<std::uint32_t>(v), time, kind, "", here});
        });
        continue;
      }
      CollisionEvent event;
      event.vehicle = static_cast<std::uint32_t>(v);
      event.partner = words[3].starts_with("obstacle ")
                          ? kFirstObstacle + static_cast<Label>(number(words[3].substr(9)))
                          : labels[words[3]];
      event.time = time;
      event.entered = words[1] == "collision";
      event.vehicle_world = here;
      event.place_world = {number(words[7]), number(words[8]), number(words[9])};
      event.penetration = number(words[10]);
      add(0, time, kCollisionRank, v, false, [event] { return Sample(event); });
    }
  }

  void add_obstacles(const std::string& path) {
    const CsvTable& t = table(path);
    for (std::size_t row = 0; row < t.rows();) {
      const SimTime time = time_at(t, row, 0);
      std::size_t last = row;
      while (last < t.rows() && time_at(t, last, 0) == time) ++last;
      add(1, time, 0, 0, true, [this, &t, time, row, last] {
        std::map<Label, BodyShape> shapes;
        for (Body& body : simulation.obstacles(time, time)) shapes[body.label] = body.shape;
        ObstacleSample sample;
        sample.time = time;
        for (std::size_t i = row; i < last; ++i) {
          const auto label = static_cast<Label>(t.at(i, 1));
          const Pose pose{rotation_at(t, i, 5), vector_at(t, i, 2)};
          sample.obstacles.push_back({label, pose, shapes[label]});
        }
        return Sample(sample);
      });
      row = last;
    }
  }

  const Executor& executor;
  Scenario scenario;
  Simulation simulation;  ///< Never stepped: models, shapes, patterns.
  RunDescription description;
  Duration step;
  SimTime end;
  std::deque<CsvTable> tables;    ///< Stay where they are.
  std::vector<PoseTrack> tracks;  ///< Of each vehicle, by the states that the run wrote.
  std::vector<Entry> entries;
  std::size_t next = 0;
};

RecordedRun::RecordedRun(const std::string& folder, const Executor& executor)
    : files_(std::make_unique<Files>(folder, executor)) {}

RecordedRun::~RecordedRun() = default;

const RunDescription& RecordedRun::description() const {
  return files_->description;
}

SimTime RecordedRun::end() const {
  return files_->end;
}

Duration RecordedRun::step() const {
  return files_->step;
}

void RecordedRun::play_step(SimTime time, SampleSink& sink) {
  const std::int64_t step = time.time_since_epoch() / files_->step;
  auto& next = files_->next;
  for (; next < files_->entries.size() && files_->entries[next].step <= step; ++next) {
    sink.on_sample(files_->entries[next].make());
  }
}

void play(RecordedRun& run, std::span<Link* const> links, const PlaybackOptions& options) {
  SampleSplitter sink;
  for (Link* link : links) sink.add(*link);
  for (Link* link : links) link->open(run.description());
  const auto is_over = [&] {
    return (options.interrupted && options.interrupted()) ||
           std::any_of(links.begin(), links.end(), [](Link* l) { return l->is_over(); });
  };
  Pace pace(options.rate);
  pace.restart_at(SimTime{});
  bool ends = false;
  for (SimTime time; !ends && !is_over(); time += run.step()) {
    run.play_step(time, sink);
    ends = time >= run.end();
    const SimTime reached = ends ? time : time + run.step();
    for (Link* link : links) link->on_step({reached, 0.0, 0});
    for (Link* link : links) {
      for (const Order& order : link->take_orders()) {
        ends = ends || std::holds_alternative<EndOrder>(order);
      }
    }
    pace.wait_for(reached);
    report(options.progress, "playing", to_seconds(reached) / to_seconds(run.end()));
  }
  for (Link* link : links) link->close();
}

}  // namespace pointflight
