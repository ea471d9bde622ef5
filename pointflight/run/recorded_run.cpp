#include "pointflight/run/recorded_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <filesystem>
#include <map>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/io/csv_table.hpp"
#include "pointflight/run/run_files.hpp"
#include "pointflight/sim/flight_recorder.hpp"

namespace pointflight {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kStateColumns = 19;  // of trajectory.csv, before the rotors

}  // namespace

std::shared_ptr<const Simulation> simulation_of_run(const std::string& folder,
                                                    const Executor& executor) {
  const Scenario scenario = load_scenario((fs::path(folder) / "scenario.yaml").string());
  return std::make_shared<const Simulation>(scenario, scenario.open_map(), executor);
}

struct RecordedRun::Files {
  /// What comes after what in a step.
  enum class Phase { kSamples, kObstacles, kArrears };
  /// One sample of the run, made when its turn comes.
  struct Entry {
    std::int64_t step;   ///< That it came in.
    Phase phase;         ///< Within the step.
    SimTime time;        ///< When it arrived.
    std::size_t first;   ///< Of one instant: the rank; of measurements in arrears: the vehicle.
    std::size_t second;  ///< The other of the two.
    std::function<Sample()> make;
  };

  Files(const std::string& folder, std::shared_ptr<const Simulation> of, const Executor& with)
      : executor(with),
        owned(std::move(of)),
        simulation(*owned),
        scenario(simulation.scenario()),
        description(describe_run(simulation)),
        step(from_seconds(scenario.physics_step)),
        end(ended_at(fs::path(folder) / "summary.json")) {
    const auto flown_elsewhere = vehicles_of_others(fs::path(folder) / "summary.json");
    for (std::size_t v = 0; v < simulation.vehicle_count(); ++v) {
      const std::string& name = description.vehicles[v].setup.name;
      const fs::path own = fs::path(folder) / name;
      // users put folders of a shared run's processes together
      description.vehicles[v].own =
          !flown_elsewhere.contains(name) || fs::is_regular_file(own / "trajectory.csv");
      if (!description.vehicles[v].own) continue;
      add_vehicle(v, simulation.vehicle_count() == 1 ? fs::path(folder) : own);
    }
    add_events((fs::path(folder) / "events.csv").string());
    add_obstacles((fs::path(folder) / "obstacles.csv").string());
    // nothing of a run is silent for long: its truth comes at trajectory_rate
    SimTime last;
    for (const Entry& entry : entries) last = std::max(last, entry.time);
    if (to_seconds(end - last) > 1.0 + 2.0 / scenario.output.trajectory_rate) {
      throw InputError(fmt::format("{}: the run ended at {:.1f} s, its files at {:.1f} s",
                                   folder,
                                   to_seconds(end),
                                   to_seconds(last)));
    }
    std::stable_sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
      return std::tie(a.step, a.phase, a.time, a.first, a.second) <
             std::tie(b.step, b.phase, b.time, b.first, b.second);
    });
  }

  /// `late`: it came in the first step that starts at its time or after it; else in the step that
  /// its time lies in.
  void add(Phase phase,
           SimTime time,
           std::size_t rank,
           std::size_t vehicle,
           bool late,
           std::function<Sample()> make) {
    const Duration since = time.time_since_epoch();
    const std::int64_t number = late ? (since + step - Duration{1}) / step : since / step;
    const bool arrears = phase == Phase::kArrears;
    entries.push_back(
        {number, phase, time, arrears ? vehicle : rank, arrears ? rank : vehicle, std::move(make)});
  }

  void add_vehicle(std::size_t v, const fs::path& folder) {
    add_states(v, folder / "trajectory.csv");
    add_odometry(v, folder / "odometry.csv");
    add_imu(v, folder / "imu.csv");
    for (const auto& [number, file] : sensor_files(simulation.vehicle(v))) {
      add_sensor(v, number, folder / file);
    }
    add_scans(v, folder);
  }

  /// Null if the run wrote no such file, or nothing but its columns' names.
  const CsvTable* table(const fs::path& path, std::size_t columns) {
    if (!has_rows(path)) return nullptr;
    const CsvTable& t = tables.emplace_back(path.string());
    if (t.columns() >= columns) return &t;
    throw InputError(
        fmt::format("{}: {} columns where a run writes {}", path.string(), t.columns(), columns));
  }

  /// Samples of a vehicle, one per row of a table or none, that came at the time in a column.
  template <class Make>
  void add_rows(const CsvTable* t,
                int column,
                std::size_t rank,
                std::size_t v,
                const Make& make,
                Phase phase = Phase::kSamples) {
    for (std::size_t row = 0; t != nullptr && row < t->rows(); ++row) {
      add(phase, time_at(*t, row, column), rank, v, phase == Phase::kArrears, [make, t, row] {
        return Sample(make(*t, row));
      });
    }
  }

  void add_states(std::size_t v, const fs::path& path) {
    const std::size_t rotors = simulation.status(v).state.rotors.size();
    const CsvTable* t = table(path, kStateColumns + rotors);
    if (t == nullptr) throw InputError(fmt::format("{}: has no states", path.string()));
    std::vector<TimedPose> poses;
    for (std::size_t row = 0; row < t->rows(); ++row) {
      const SimTime time = time_at(*t, row, 0);
      if (!poses.empty() && time <= poses.back().time) {
        throw InputError(fmt::format("{}: times must ascend", t->location(row)));
      }
      poses.push_back({time, body_at(*t, row, 1).T_world_body()});
    }
    tracks.emplace(v, std::move(poses));
    add_rows(t, 0, kStateRank, v, [v, rotors](const CsvTable& table, std::size_t row) {
      StateSample sample;
      sample.vehicle = static_cast<std::uint32_t>(v);
      sample.time = time_at(table, row, 0);
      sample.state.body = body_at(table, row, 1);
      sample.command.p_world = vector_at(table, row, 14);
      if (const double distance = table.at(row, 17); !std::isnan(distance)) {
        sample.nearest = Contact{distance, Vector3d::Zero(), label_at(table, row, 18)};
      }
      sample.state.rotors.resize(rotors);
      for (std::size_t i = 0; i < rotors; ++i) {
        sample.state.rotors[i].speed = table.at(row, static_cast<int>(kStateColumns + i));
      }
      return sample;
    });
  }

  void add_odometry(std::size_t v, const fs::path& path) {
    add_rows(table(path, 15), 1, kSensorRank, v, [v](const CsvTable& table, std::size_t row) {
      OdometrySample sample;
      sample.vehicle = static_cast<std::uint32_t>(v);
      sample.time = time_at(table, row, 0);
      sample.delivered = time_at(table, row, 1);
      sample.state = body_at(table, row, 2);
      sample.truth = table.columns() > 15 ? body_at(table, row, 15) : sample.state;
      return sample;
    });
  }

  void add_imu(std::size_t v, const fs::path& path) {
    const Vector3d rpy = description.vehicles[v].settings.imu.rotation_rpy_deg * kDegree;
    const Quaterniond q_body_imu = quaternion_from_rpy(rpy.x(), rpy.y(), rpy.z());
    const auto make = [this, v, q_body_imu](const CsvTable& table, std::size_t row) {
      ImuSample sample;
      sample.vehicle = static_cast<std::uint32_t>(v);
      sample.time = time_at(table, row, 0);
      sample.stamp = table.columns() > 7 ? time_at(table, row, 7) : sample.time;
      sample.gyro = vector_at(table, row, 1);
      sample.accel = vector_at(table, row, 4);
      sample.q_world_imu = rotation_of(v, sample.time) * q_body_imu;
      return sample;
    };
    add_rows(table(path, 7), 0, kSensorRank + 1, v, make);
  }

  void add_sensor(std::size_t v, std::size_t number, const fs::path& path) {
    const MountedSensor& sensor = simulation.vehicle(v).sensors()[number];
    const std::size_t values = sensor.kind->columns.size();
    const auto make = [v, number, values](const CsvTable& table, std::size_t row) {
      Measurement sample;
      sample.vehicle = static_cast<std::uint32_t>(v);
      sample.sensor = static_cast<std::uint32_t>(number);
      sample.time = time_at(table, row, 0);
      sample.delivered = time_at(table, row, 1);
      for (std::size_t i = 0; i < values; ++i) {
        sample.values.push_back(table.at(row, 2 + static_cast<int>(i)));
      }
      return sample;
    };
    const bool arrears = sensor.interval != nullptr;
    add_rows(table(path, 2 + values),
             1,
             arrears ? number : kSensorRank + number,
             v,
             make,
             arrears ? Phase::kArrears : Phase::kSamples);
  }

  /// As it was written, where a state was.
  [[nodiscard]] Quaterniond rotation_of(std::size_t v, SimTime time) const {
    const PoseTrack& track = tracks.at(v);
    const auto records = track.records();
    const auto at =
        std::lower_bound(records.begin(), records.end(), time, [](const TimedPose& r, SimTime t) {
          return r.time < t;
        });
    const bool written = at != records.end() && at->time == time;
    return written ? at->pose.rotation : track.at(time).rotation;
  }

  void add_scans(std::size_t v, const fs::path& folder) {
    const VehicleAgent& agent = simulation.vehicle(v);
    const std::size_t before = agent.sensors().size() - agent.lidars().size();
    const std::string path = (folder / "scans.csv").string();
    const Folder own(folder.string());
    for (WordTable rows(path, 6); rows.next();) {
      Scan scan;
      scan.vehicle = static_cast<std::uint32_t>(v);
      scan.sensor = rows.index(rows.word(1), agent.lidars().size(), "lidar");
      scan.index = rows.count(2);
      scan.start = rows.time(3);
      scan.end = rows.time(4);
      scan.beams = rows.count(5);
      const std::string points = file_of_run(own, std::string(rows.word(0)), path);
      add(Phase::kArrears, scan.end, before + scan.sensor, v, true, [this, scan, points] {
        return with_points(scan, points);
      });
    }
  }

  [[nodiscard]] Sample with_points(Scan scan, const std::string& path) const {
    const MountedLidar& mounted = *simulation.vehicle(scan.vehicle).lidars()[scan.sensor];
    const PoseTrack track = tracks.at(scan.vehicle).with_mount(mounted.T_body_sensor());
    const std::vector<Beam> beams = mounted.beams_of(scan.index, executor);
    scan.snapshot = mounted.takes_snapshots();
    scan.marks = mounted.marks();
    scan.middle = mounted.lidar().middle_of(scan.start, beams, scan.snapshot);
    read_scan_points(path, beams, mounted.lidar().settings().deskewing, scan);
    return ScanSample{std::make_shared<const Scan>(std::move(scan)), track};
  }

  void add_events(const std::string& path) {
    std::map<std::string, std::uint32_t, std::less<>> numbers;
    for (std::size_t v = 0; v < simulation.vehicle_count(); ++v) {
      numbers[description.vehicles[v].setup.name] = static_cast<std::uint32_t>(v);
    }
    for (WordTable rows(path, 11); rows.next();) {
      const auto vehicle = numbers.find(rows.word(2));
      if (vehicle == numbers.end()) {
        throw InputError(
            fmt::format("{}: the scenario has no vehicle '{}'", rows.at(), excerpt(rows.word(2))));
      }
      const std::string_view kind = rows.word(1);
      const std::string_view partner = rows.word(3);
      std::optional<Label> other;
      if (const auto found = numbers.find(partner); found != numbers.end()) {
        other = kFirstVehicle + found->second;
      }
      const SimTime time = rows.time(0);
      const std::uint32_t v = vehicle->second;
      if (!kind.starts_with("collision")) {
        VehicleEvent event;
        event.vehicle = v;
        event.time = time;
        event.kind = kind;
        event.vehicle_world = rows.position(4);
        event.partner = other;
        if (event.partner) event.penetration = rows.number(10);
        add(Phase::kSamples, time, kEventRank, v, true, [event] { return Sample(event); });
        continue;
      }
      CollisionEvent event;
      event.vehicle = v;
      if (partner.starts_with("obstacle ")) {
        event.partner =
            kFirstObstacle + rows.index(partner.substr(9), simulation.obstacle_count(), "obstacle");
      } else if (other) {
        event.partner = *other;
      }
      event.time = time;
      event.entered = kind == "collision";
      event.vehicle_world = rows.position(4);
      event.position_world = rows.position(7);
      event.penetration = rows.number(10);
      add(Phase::kSamples, time, kCollisionRank, v, true, [event] { return Sample(event); });
    }
  }

  void add_obstacles(const std::string& path) {
    const CsvTable* t = table(path, 9);
    for (std::size_t row = 0; t != nullptr && row < t->rows();) {
      const SimTime time = time_at(*t, row, 0);
      std::size_t last = row;
      while (last < t->rows() && time_at(*t, last, 0) == time) ++last;
      add(Phase::kObstacles, time, 0, 0, false, [this, t, time, row, last] {
        std::map<Label, BodyShape> shapes;
        for (Body& body : simulation.obstacles(time, time)) shapes[body.label] = body.shape;
        ObstacleSample sample;
        sample.time = time;
        for (std::size_t i = row; i < last; ++i) {
          const Label label = label_at(*t, i, 1);
          const Pose pose{rotation_at(*t, i, 5), position_at(*t, i, 2)};
          sample.obstacles.push_back({label, pose, shapes[label]});
        }
        return Sample(sample);
      });
      row = last;
    }
  }

  const Executor& executor;
  std::shared_ptr<const Simulation> owned;
  const Simulation& simulation;  ///< Never stepped: models, shapes, patterns.
  const Scenario& scenario;
  RunDescription description;
  Duration step;
  SimTime end;
  std::deque<CsvTable> tables;              ///< Stay where they are.
  std::map<std::size_t, PoseTrack> tracks;  ///< By the states that the run wrote of a vehicle.
  std::vector<Entry> entries;
  std::size_t next = 0;
};

RecordedRun::RecordedRun(const std::string& folder, const Executor& executor)
    : RecordedRun(folder, simulation_of_run(folder, executor), executor) {}

RecordedRun::RecordedRun(const std::string& folder,
                         std::shared_ptr<const Simulation> simulation,
                         const Executor& executor)
    : files_(std::make_unique<Files>(folder, std::move(simulation), executor)) {}

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

void RecordedRun::seek(SimTime time) {
  const std::int64_t step = time.time_since_epoch() / files_->step;
  const auto& entries = files_->entries;
  const auto at =
      std::lower_bound(entries.begin(), entries.end(), step, [](const auto& e, std::int64_t s) {
        return e.step < s;
      });
  files_->next = static_cast<std::size_t>(at - entries.begin());
}

void RecordedRun::play_step(SimTime time, SampleSink& sink) {
  const std::int64_t step = time.time_since_epoch() / files_->step;
  auto& next = files_->next;
  for (; next < files_->entries.size() && files_->entries[next].step <= step; ++next) {
    sink.on_sample(files_->entries[next].make());
  }
}

}  // namespace pointflight
