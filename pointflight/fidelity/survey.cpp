#include "pointflight/fidelity/survey.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <unordered_set>
#include <utility>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/fidelity/scene_renderer.hpp"
#include "pointflight/geometry/internal/grid_cells.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/io/pcd_writer.hpp"
#include "pointflight/io/pose_files.hpp"
#include "pointflight/lidar/lidar.hpp"

namespace pointflight {
namespace {

namespace fs = std::filesystem;

/// What is told apart after the scan: whether something was too near, or nothing was there.
LidarSettings sees_all_near(LidarSettings lidar, double noise) {
  lidar.range_min = 0.0;
  lidar.noise = {.range_sigma = noise};
  return lidar;
}

/// Takes the scans of a walk.
class Surveyor {
 public:
  Surveyor(const ExactScene& scene,
           const SceneTree& tree,
           const LidarSettings& lidar,
           const SurveyOptions& options)
      : renderer_(scene, tree),
        lidar_(sees_all_near(lidar, options.noise), 0),
        nearest_(static_cast<float>(lidar.range_min)),
        options_(options) {}

  [[nodiscard]] Duration period() const { return lidar_.period(); }

  [[nodiscard]] std::vector<SurveyShot> take(std::size_t index,
                                             SimTime start,
                                             const PoseTrack& T_world_sensor,
                                             const Executor& executor) const {
    ScanRequest request;
    request.index = index;
    request.start = start;
    request.seed = options_.seed;
    const Scan scan = lidar_.take(request, T_world_sensor, renderer_, executor);
    const std::vector<Beam> beams = lidar_.beams(index, executor);
    // how far a sensor is sure to see depends on the surface: half of its reach is safe
    const auto free = static_cast<float>(0.5 * lidar_.settings().range_max);
    std::vector<SurveyShot> shots;
    shots.reserve(beams.size());
    auto point = scan.points.begin();
    for (std::size_t i = 0; i < beams.size(); ++i) {
      SurveyShot shot;
      shot.time = static_cast<float>(to_seconds(beams[i].time_offset));
      shot.is_return = point != scan.points.end() && point->beam == i;
      shot.position_sensor = beams[i].origin_sensor + free * beams[i].direction_sensor;
      if (shot.is_return) {
        shot.position_sensor = point->position_sensor;
        if ((point++)->range < nearest_) continue;
      }
      shots.push_back(shot);
    }
    return shots;
  }

  /// What the surveyor's poses are wrong by.
  [[nodiscard]] Pose shake(std::size_t index) const {
    const RandomStream random(options_.seed, StreamId::kSurvey, survey_draws::kShake);
    std::array<double, 6> n{};
    for (std::size_t i = 0; i < 3; ++i) {
      const auto two = random.normal2(3 * index + i);
      n[2 * i] = two[0];
      n[2 * i + 1] = two[1];
    }
    const Vector3d turn(n[3], n[4], n[5]);
    return {quaternion_from_rotation_vector(options_.shake_deg * kDegree * turn),
            options_.shake * Vector3d(n[0], n[1], n[2])};
  }

  /// What they have drifted by when a share of the walk is over, world: two waves that end as they
  /// began, in directions of their own.
  [[nodiscard]] Vector3d drift(double share) const {
    const RandomStream random(options_.seed, StreamId::kSurvey, survey_draws::kDrift);
    const auto [a, b] = random.uniform2(0);
    const auto [c, d] = random.uniform2(1);
    const Vector3d slow = unit_direction(2.0 * kPi * a, 0.5 * b - 0.25);
    const Vector3d fast = unit_direction(2.0 * kPi * c, 0.5 * d - 0.25);
    return options_.drift *
           (math::sin(kPi * share) * slow + 0.4 * math::sin(3 * kPi * share) * fast);
  }

 private:
  SceneRenderer renderer_;
  Lidar lidar_;
  float nearest_;  // m
  const SurveyOptions& options_;
};

class SurveyInMemory : public SurveyReader {
 public:
  explicit SurveyInMemory(const Survey& survey, std::function<bool(std::size_t scan)> chosen = {})
      : survey_(survey), chosen_(std::move(chosen)) {}

  bool read(std::vector<SurveyRay>& batch) override {
    batch.clear();
    for (; batch.empty() && next_ < survey_.scans.size(); ++next_) {
      if (chosen_ && !chosen_(next_)) continue;
      for (const SurveyShot& shot : survey_.scans[next_]) {
        const Pose pose =
            pose_on(survey_.poses,
                    survey_.poses[next_].time + from_seconds(static_cast<double>(shot.time)));
        batch.push_back(survey_ray(pose, shot.position_sensor.cast<double>(), shot.is_return));
      }
    }
    return !batch.empty();
  }
  [[nodiscard]] std::size_t scan() const override { return next_ - 1; }
  [[nodiscard]] double share_read() const override {
    return static_cast<double>(next_) / static_cast<double>(survey_.scans.size());
  }

 private:
  const Survey& survey_;
  std::function<bool(std::size_t scan)> chosen_;
  std::size_t next_ = 0;
};

class ScansInMemory : public SurveySource {
 public:
  explicit ScansInMemory(const Survey& survey) : survey_(survey) {}

  [[nodiscard]] std::size_t scan_count() const override { return survey_.scans.size(); }
  [[nodiscard]] std::string name(std::size_t scan) const override {
    return fmt::format("scan {}", scan);
  }
  [[nodiscard]] Pose pose(std::size_t scan) const override { return survey_.poses[scan].pose; }
  [[nodiscard]] std::unique_ptr<SurveyReader> open(
      const std::function<bool(std::size_t scan)>& chosen) const override {
    return std::make_unique<SurveyInMemory>(survey_, chosen);
  }

 private:
  const Survey& survey_;
};

class ThinnedCloud : public CloudReader {
 public:
  ThinnedCloud(std::unique_ptr<CloudReader> cloud, double width)
      : cloud_(std::move(cloud)), width_(width) {}

  bool read(std::vector<CloudPoint>& batch) override {
    batch.clear();
    while (batch.empty() && cloud_->read(read_)) {
      for (const CloudPoint& point : read_) {
        if (kept_.insert(grid_key(grid_cell(point.position, width_))).second)
          batch.push_back(point);
      }
    }
    return !batch.empty();
  }
  [[nodiscard]] bool has_intensity() const override { return cloud_->has_intensity(); }
  [[nodiscard]] double share_read() const override { return cloud_->share_read(); }

 private:
  std::unique_ptr<CloudReader> cloud_;
  double width_;
  std::vector<CloudPoint> read_;
  std::unordered_set<std::uint64_t> kept_;
};

void write_shots(const std::vector<SurveyShot>& shots, bool returns, const std::string& path) {
  std::vector<std::array<float, 4>> rows;
  for (const SurveyShot& shot : shots) {
    if (shot.is_return != returns) continue;
    const Vector3f& p = shot.position_sensor;
    rows.push_back({p.x(), p.y(), p.z(), shot.time});
  }
  write_pcd(OutputFile(path),
            {{"x", 'F', 4}, {"y", 'F', 4}, {"z", 'F', 4}, {"time", 'F', 4}},
            rows.size(),
            as_bytes(rows));
}

}  // namespace

Survey make_survey(const ExactScene& scene,
                   const SceneTree& tree,
                   const LidarSettings& lidar,
                   const SurveyOptions& options,
                   const Executor& executor,
                   const Progress& progress) {
  const Surveyor surveyor(scene, tree, lidar, options);
  Survey survey;
  survey.walk = make_walk(scene, tree, options, surveyor.period());
  const PoseTrack T_world_sensor(survey.walk);
  for (std::size_t i = 0; i + 1 < survey.walk.size(); ++i) {
    report(progress,
           "surveying " + scene.name,
           static_cast<double>(i) / static_cast<double>(survey.walk.size()));
    const TimedPose& truth = survey.walk[i];
    Pose believed = truth.pose * surveyor.shake(i);
    believed.translation +=
        surveyor.drift(static_cast<double>(i) / static_cast<double>(survey.walk.size() - 1));
    survey.poses.push_back({truth.time, believed});
    survey.scans.push_back(surveyor.take(i, truth.time, T_world_sensor, executor));
  }
  return survey;
}

std::unique_ptr<SurveyReader> rays_of(const Survey& survey) {
  return std::make_unique<SurveyInMemory>(survey);
}

std::unique_ptr<SurveySource> scans_of(const Survey& survey) {
  return std::make_unique<ScansInMemory>(survey);
}

void write_survey(const Survey& survey, const std::string& folder, const Progress& progress) {
  const fs::path path(folder);
  for (const char* part : {"scans", "free"}) {
    std::error_code error;
    fs::create_directories(path / part, error);
    if (error) {
      throw InputError(fmt::format("{}: {}", (path / part).string(), error.message()));
    }
  }
  std::vector<TumPose> poses;
  for (std::size_t i = 0; i < survey.poses.size(); ++i) {
    const TimedPose& believed = survey.poses[i];
    TumPose& pose = poses.emplace_back();
    pose.time = to_seconds(believed.time.time_since_epoch());
    pose.T_world_sensor = believed.pose;
    pose.file = fmt::format("{:06}.pcd", i);
    report(progress,
           "writing the survey",
           static_cast<double>(i) / static_cast<double>(survey.scans.size()));
    write_shots(survey.scans[i], true, (path / "scans" / pose.file).string());
    write_shots(survey.scans[i], false, (path / "free" / pose.file).string());
  }
  write_tum(OutputFile((path / "poses.tum").string()), poses);
}

std::unique_ptr<CloudReader> thinned(std::unique_ptr<CloudReader> cloud, double width) {
  return std::make_unique<ThinnedCloud>(std::move(cloud), width);
}

}  // namespace pointflight
