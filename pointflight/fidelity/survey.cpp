#include "pointflight/fidelity/survey.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <unordered_set>
#include <utility>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/io/pcd_writer.hpp"
#include "pointflight/io/pose_files.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "pointflight/survey/grid_cells.hpp"

namespace pointflight {
namespace {

namespace fs = std::filesystem;

/// Takes the scans of a walk.
class Surveyor {
 public:
  Surveyor(const SceneTree& tree, const LidarSettings& lidar, const SurveyOptions& options)
      : tree_(tree), lidar_(lidar, 0), options_(options) {}

  [[nodiscard]] Duration period() const { return lidar_.period(); }

  [[nodiscard]] std::vector<SurveyShot> take(std::size_t index,
                                             const Pose& from,
                                             const Pose& to,
                                             const Executor& executor) const {
    const auto beams = lidar_.beams(index, executor);
    const RandomStream noise(
        options_.seed, StreamId::kSurvey, survey_draws::kNoise + static_cast<std::uint32_t>(index));
    std::vector<SurveyShot> shots(beams.size());
    std::vector<std::uint8_t> lost(beams.size(), 0);
    const double reach = lidar_.settings().range_max;
    const double nearest = lidar_.settings().range_min;
    executor.parallel_for(beams.size(), 512, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Beam& beam = beams[i];
        const double at = to_seconds(beam.time_offset);
        const Pose pose = interpolate(from, to, at / to_seconds(period()));
        const Vector3d o = pose * beam.origin_sensor.cast<double>();
        const Vector3d d = pose.rotation * beam.direction_sensor.cast<double>().normalized();
        const auto met = tree_.intersect(o, d);
        shots[i].time = static_cast<float>(at);
        shots[i].is_return = met && met->range <= reach;
        lost[i] = met && met->range < nearest ? 1 : 0;
        // how far a sensor is sure to see depends on the surface: half of its reach is safe
        double range = 0.5 * reach;
        if (shots[i].is_return) range = met->range + options_.noise * noise.normal(i);
        shots[i].position_sensor =
            beam.origin_sensor + static_cast<float>(range) * beam.direction_sensor;
      }
    });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < shots.size(); ++i) {
      if (lost[i] == 0) shots[kept++] = shots[i];
    }
    shots.resize(kept);
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

 private:
  const SceneTree& tree_;
  Lidar lidar_;
  const SurveyOptions& options_;
};

class SurveyInMemory : public SurveyReader {
 public:
  explicit SurveyInMemory(const Survey& survey) : survey_(survey) {}

  bool read(std::vector<SurveyRay>& batch) override {
    batch.clear();
    for (; batch.empty() && next_ < survey_.scans.size(); ++next_) {
      for (const SurveyShot& shot : survey_.scans[next_]) {
        const Pose pose =
            pose_on(survey_.poses,
                    survey_.poses[next_].time + from_seconds(static_cast<double>(shot.time)));
        batch.push_back(survey_ray(pose, shot.position_sensor.cast<double>(), shot.is_return));
      }
    }
    return !batch.empty();
  }
  [[nodiscard]] double share_read() const override {
    return static_cast<double>(next_) / static_cast<double>(survey_.scans.size());
  }

 private:
  const Survey& survey_;
  std::size_t next_ = 0;
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
  const Surveyor surveyor(tree, lidar, options);
  Survey survey;
  survey.walk = make_walk(scene, tree, options, surveyor.period());
  for (std::size_t i = 0; i + 1 < survey.walk.size(); ++i) {
    report(progress,
           "surveying " + scene.name,
           static_cast<double>(i) / static_cast<double>(survey.walk.size()));
    const TimedPose& truth = survey.walk[i];
    survey.poses.push_back({truth.time, truth.pose * surveyor.shake(i)});
    survey.scans.push_back(
        surveyor.take(i, survey.walk[i].pose, survey.walk[i + 1].pose, executor));
  }
  return survey;
}

std::unique_ptr<SurveyReader> rays_of(const Survey& survey) {
  return std::make_unique<SurveyInMemory>(survey);
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
