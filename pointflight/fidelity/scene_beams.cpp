#include "pointflight/fidelity/scene_beams.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/scenes/scene_tree.hpp"

namespace pointflight {
namespace {

constexpr double kFreeRadius = 0.3;                // m
constexpr double kBeside = 0.2 * kDegree;          // where silhouettes are looked for
constexpr double kJump = ErrorStatistics::kRight;  // m
constexpr double kAimSpread = 0.1;                 // m, around the positions aimed at

BeamPlan grid_plan(const std::string& name,
                   std::array<int, 2> size,
                   std::array<double, 2> azimuth_deg,
                   std::array<double, 2> elevation_deg,
                   float range_max) {
  BeamPlan plan;
  plan.name = name;
  plan.range_max = range_max;
  for (int j = 0; j < size[1]; ++j) {
    for (int i = 0; i < size[0]; ++i) {
      // centres of the grid's squares
      const double az = azimuth_deg[0] + (i + 0.5) * (azimuth_deg[1] - azimuth_deg[0]) / size[0];
      const double el =
          elevation_deg[0] + (j + 0.5) * (elevation_deg[1] - elevation_deg[0]) / size[1];
      plan.directions_sensor.push_back(unit_direction(az * kDegree, el * kDegree).cast<float>());
    }
  }
  return plan;
}

BeamPlan uniform_plan() {
  BeamPlan plan;
  plan.name = "mid360_uniform";
  plan.range_max = 40.0f;
  const RandomStream random(1, StreamId::kAimedBeams, 0);
  for (std::uint64_t i = 0; i < 20000; ++i) {
    const auto [u, v] = random.uniform2(i);
    plan.directions_sensor.push_back(
        unit_direction(2.0 * kPi * u, (-7.0 + 59.0 * v) * kDegree).cast<float>());
  }
  return plan;
}

std::vector<Pose> poses_of(const ExactScene& scene, const SceneTree& tree, const BeamPlan& plan) {
  if (!plan.places.empty()) return plan.places;
  if (!scene.poses.empty()) return scene.poses;
  constexpr std::uint64_t kTries = 20000;
  const RandomStream random(plan.seed, StreamId::kScenePoses, 0);
  std::vector<Pose> poses;
  for (std::uint64_t i = 0; i < kTries && poses.size() < plan.poses; ++i) {
    const auto [u, v] = random.uniform2(2 * i);
    const auto [w, turn] = random.uniform2(2 * i + 1);
    const Vector3d place = scene.free.min + scene.free.size().cwiseProduct(Vector3d(u, v, w));
    if (!tree.is_free(place, kFreeRadius, 500)) continue;
    poses.push_back({quaternion_from_rpy(0, 0, 2.0 * kPi * turn), place});
  }
  if (poses.size() < plan.poses) {
    throw InputError(fmt::format(
        "scene '{}': no place for a sensor with {} m around it", scene.name, kFreeRadius));
  }
  return poses;
}

/// Two unit vectors across a direction.
std::array<Vector3d, 2> across(const Vector3d& d) {
  const Vector3d helper = std::abs(d.z()) < 0.9 ? Vector3d::UnitZ() : Vector3d::UnitX();
  const Vector3d u = d.cross(helper).normalized();
  return {u, d.cross(u)};
}

class Caster {
 public:
  Caster(const ExactScene& scene, const SceneTree& tree, const BeamPlan& plan)
      : scene_(scene), tree_(tree), plan_(plan) {
    double sum = 0.0;
    for (std::uint32_t i = 0; i < scene.geometry.shapes.size(); ++i) {
      if (!scene.is_target[i]) continue;
      targets_.push_back(i);
      // every tag gets as many beams, whatever its area
      double same = 0.0;
      for (std::size_t k = 0; k < scene.geometry.shapes.size(); ++k) {
        if (scene.is_target[k] && scene.shape_tag[k] == scene.shape_tag[i]) {
          same += area(scene.geometry.shapes[k]);
        }
      }
      sum += area(scene.geometry.shapes[i]) / same;
      share_.push_back(sum);
    }
  }

  [[nodiscard]] std::size_t per_pose() const {
    return plan_.directions_sensor.empty() ? plan_.aimed_beams : plan_.directions_sensor.size();
  }

  [[nodiscard]] TrueBeam cast(std::size_t pose_index, const Pose& pose, std::size_t beam) const {
    TrueBeam result;
    result.ray.origin_world = pose.translation;
    result.ray.range_max = plan_.range_max;
    const Vector3d d = plan_.directions_sensor.empty()
                           ? aimed(pose_index, pose.translation, beam)
                           : Vector3d(pose.rotation * plan_.directions_sensor[beam].cast<double>());
    result.ray.direction_world = d.cast<float>();
    look(result);
    return result;
  }

 private:
  [[nodiscard]] Vector3d aimed(std::size_t pose, const Vector3d& from, std::size_t beam) const {
    const RandomStream random(plan_.seed, StreamId::kAimedBeams, static_cast<std::uint32_t>(pose));
    const auto [u, v] = random.uniform2(3 * beam);
    if (targets_.empty()) return unit_direction(2.0 * kPi * u, math::asin(2.0 * v - 1.0));
    const auto [w, a] = random.uniform2(3 * beam + 1);
    const auto [b, c] = random.uniform2(3 * beam + 2);
    const auto at = std::upper_bound(share_.begin(), share_.end(), w * share_.back());
    const auto index = std::min(static_cast<std::size_t>(at - share_.begin()), share_.size() - 1);
    const Vector3d spread = Vector3d(a, b, c) - Vector3d::Constant(0.5);
    const Vector3d place =
        point_on(scene_.geometry.shapes[targets_[index]], u, v) + 2.0 * kAimSpread * spread;
    return (place - from).normalized();
  }

  void look(TrueBeam& beam) const {
    const Vector3d d = beam.ray.direction_world.cast<double>().normalized();
    const Vector3d& o = beam.ray.origin_world;
    const auto reach = static_cast<double>(beam.ray.range_max);
    const auto met = tree_.intersect(o, d);
    const bool returns = met && met->range <= reach;
    Vector3d normal = Vector3d::Zero();
    double plane = 0.0;
    if (returns) {
      const Vector3d p = o + met->range * d;
      normal = normal_at(scene_.geometry.shapes[met->shape], p);
      plane = normal.dot(p - o);
      beam.range = static_cast<float>(met->range);
      beam.cos_incidence = static_cast<float>(std::min(1.0, std::abs(normal.dot(d))));
      beam.normal_world = (normal.dot(d) > 0.0 ? Vector3d(-normal) : normal).cast<float>();
      beam.tag = scene_.shape_tag[met->shape];
    }
    const auto [u, v] = across(d);
    for (int i = 0; i < 16 && !beam.silhouette; ++i) {
      // eight directions half-way to the rim, eight on it between them
      const auto angle = math::sincos((0.25 * i + (i < 8 ? 0.125 : 0.0)) * kPi);
      const double offset = i < 8 ? 0.5 * kBeside : kBeside;
      const Vector3d beside = (d + offset * (angle.cos * u + angle.sin * v)).normalized();
      const auto there = tree_.intersect(o, beside);
      const bool also = there && there->range <= reach;
      if (i == 0 && also) beam.range_beside = static_cast<float>(there->range);
      if (!returns || !also) {
        beam.silhouette = returns != also;
        continue;
      }
      beam.silhouette = std::abs(there->range - plane / normal.dot(beside)) > kJump;
    }
  }

  const ExactScene& scene_;
  const SceneTree& tree_;
  const BeamPlan& plan_;
  std::vector<std::uint32_t> targets_;
  std::vector<double> share_;  ///< Running sum of the targets' shares of the beams.
};

/// Collectors for the classes of one kind, in the order of their limits.
class Classes {
 public:
  explicit Classes(std::vector<std::string> names)
      : names_(std::move(names)), collectors_(names_.size()) {}
  ErrorCollector& at(std::size_t i) { return collectors_[i]; }
  [[nodiscard]] std::vector<FidelityRow> rows() const {
    std::vector<FidelityRow> rows;
    for (std::size_t i = 0; i < names_.size(); ++i) {
      const ErrorStatistics s = collectors_[i].statistics();
      if (s.rays > 0) rows.push_back({names_[i], s});
    }
    return rows;
  }

 private:
  std::vector<std::string> names_;
  std::vector<ErrorCollector> collectors_;
};

constexpr std::array<double, 5> kIncidences = {30, 60, 75, 85, 90};  // degrees, upper limits
constexpr std::array<float, 5> kRanges = {5, 10, 20, 40, 1e9f};      // m, upper limits

std::size_t incidence_class(float cos_incidence) {
  std::size_t i = 0;
  const double angle = math::acos(static_cast<double>(cos_incidence)) / kDegree;
  while (i + 1 < kIncidences.size() && angle > kIncidences[i]) ++i;
  return i;
}

std::size_t range_class(float range) {
  std::size_t i = 0;
  while (i + 1 < kRanges.size() && range > kRanges[i]) ++i;
  return i;
}

}  // namespace

std::optional<BeamPlan> table_beams(const std::string& name) {
  if (name == "avia_grid") return grid_plan(name, {385, 350}, {-38.5, 38.5}, {-35, 35}, 30.0f);
  if (name == "mid360_uniform") return uniform_plan();
  if (name == "vlp32_grid") {
    const double half = 0.5 * 40.0 / 31.0;  // 32 rings from -25 to 15 degrees
    return grid_plan(name, {1800, 32}, {-180, 180}, {-25 - half, 15 + half}, 100.0f);
  }
  return std::nullopt;
}

SceneBeams cast_exactly(const ExactScene& scene,
                        const BeamPlan& plan,
                        const Executor& executor,
                        const Progress& progress) {
  const SceneTree tree(scene);
  SceneBeams result;
  result.plan = plan;
  result.poses = poses_of(scene, tree, plan);
  const Caster caster(scene, tree, result.plan);
  const std::size_t count = caster.per_pose();
  result.beams.resize(count * result.poses.size());
  for (std::size_t pose = 0; pose < result.poses.size(); ++pose) {
    report(progress,
           "casting exact beams",
           static_cast<double>(pose) / static_cast<double>(result.poses.size()));
    executor.parallel_for(count, 512, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        result.beams[pose * count + i] = caster.cast(pose, result.poses[pose], i);
      }
    });
  }
  return result;
}

FidelityReport measure_fidelity(const ExactScene& scene,
                                const SceneBeams& beams,
                                const Renderer& renderer,
                                const Executor& executor) {
  FidelityReport report;
  report.rendered.reserve(beams.beams.size());
  const std::size_t count = beams.per_pose();
  std::vector<Ray> rays(count);
  std::vector<Hit> hits(count);
  for (std::size_t pose = 0; pose < beams.poses.size(); ++pose) {
    for (std::size_t i = 0; i < count; ++i) rays[i] = beams.beams[pose * count + i].ray;
    RayBatch batch;
    batch.rays = rays;
    batch.T_world_sensor = beams.poses[pose];
    batch.range_max = beams.plan.range_max;
    renderer.render(batch, hits, executor);
    for (const Hit& hit : hits) report.rendered.push_back(hit.is_return() ? hit.range : -1.0f);
  }

  Classes all({"all", "interior", "silhouette"});
  Classes tags(scene.tags);
  Classes incidences({"0-30 deg", "30-60 deg", "60-75 deg", "75-85 deg", "85-90 deg"});
  Classes ranges({"0-5 m", "5-10 m", "10-20 m", "20-40 m", "beyond 40 m"});
  for (std::size_t i = 0; i < beams.beams.size(); ++i) {
    const TrueBeam& beam = beams.beams[i];
    const float rendered = report.rendered[i];
    ErrorCollector& kind = all.at(beam.silhouette ? 2 : 1);
    if (beam.range < 0.0f) {
      kind.add_empty(rendered >= 0.0f);
      all.at(0).add_empty(rendered >= 0.0f);
      continue;
    }
    std::optional<double> range;
    if (rendered >= 0.0f) range = static_cast<double>(rendered);
    for (ErrorCollector* collector : {&all.at(0),
                                      &kind,
                                      &tags.at(beam.tag),
                                      &incidences.at(incidence_class(beam.cos_incidence)),
                                      &ranges.at(range_class(beam.range))}) {
      collector->add(static_cast<double>(beam.range), range);
    }
  }
  const auto statistics = [&](std::size_t i) { return all.at(i).statistics(); };
  report.all = statistics(0);
  report.interior = statistics(1);
  report.silhouette = statistics(2);
  report.by_tag = tags.rows();
  report.by_incidence = incidences.rows();
  report.by_range = ranges.rows();
  return report;
}

}  // namespace pointflight
