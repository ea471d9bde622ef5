// Renderers side by side on the same surfels and the same rays, in turns within one run: the
// machine may be shared, so read the ratios. `./dev bench render`; see BENCHMARK.md.
#if __has_include(<embree4/rtcore.h>)  // Debian 13
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif
#include <fmt/format.h>
#include <time.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <chrono>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>

#include "pointflight/fidelity/scene_beams.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/render/internal/beam_renderer.hpp"
#include "pointflight/render/internal/direction_order.hpp"
#include "pointflight/render/internal/paper_renderer.hpp"

namespace pointflight {
namespace {

struct Flags {
  std::vector<std::string> scenes = {"hall", "forest"};
  std::vector<double> resolutions = {0.05};
  std::vector<std::string> patterns = {"avia_grid", "mid360_uniform", "vlp32_grid"};
  std::vector<std::string> contestants;
  std::string kernel;
  bool normal = false;
  int repeats = 5;
  bool json = false;
};

double cpu_seconds() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::shared_ptr<const SurfelMap> map_of(const ExactScene& scene,
                                        double resolution,
                                        TreeQuality quality) {
  SceneSampling sampling;
  sampling.resolution = resolution;
  ImportOptions options;
  options.resolution = resolution;
  options.quality = quality;
  const ImportedMap map = build_map(
      {scene.name},
      [&](std::size_t) { return sampled_cloud(scene, sampling); },
      options,
      Executor(0));
  return SurfelMap::from_bytes(map_bytes(map.tree, map.description), scene.name);
}

/// A query of Embree, whose calls differ between its versions 3 and 4.
class EmbreeQuery {
 public:
  explicit EmbreeQuery(bool coherent) {
#if RTC_VERSION_MAJOR >= 4
    rtcInitIntersectArguments(&how_);
    if (coherent) how_.flags = RTC_RAY_QUERY_FLAG_COHERENT;
#else
    rtcInitIntersectContext(&how_);
    if (coherent) how_.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
#endif
  }

#if RTC_VERSION_MAJOR >= 4
  void one(RTCScene scene, RTCRayHit& hit) {
    rtcIntersect1(scene, &hit, &how_);
  }
  void eight(RTCScene scene, const int* valid, RTCRayHit8& hit) {
    rtcIntersect8(valid, scene, &hit, &how_);
  }

 private:
  RTCIntersectArguments how_{};
#else
  void one(RTCScene scene, RTCRayHit& hit) {
    rtcIntersect1(scene, &how_, &hit);
  }
  void eight(RTCScene scene, const int* valid, RTCRayHit8& hit) {
    rtcIntersect8(valid, scene, &how_, &hit);
  }

 private:
  RTCIntersectContext how_{};
#endif
};

/// Embree's oriented discs of radius sqrt(3)/2 r at the surfels: the first one hit is the range.
class EmbreeDiscs {
 public:
  explicit EmbreeDiscs(const SurfelMap& map)
      : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_)) {
    const RTCGeometry discs = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_ORIENTED_DISC_POINT);
    const std::size_t n = map.surfel_count();
    auto* places = static_cast<float*>(rtcSetNewGeometryBuffer(
        discs, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, 4 * sizeof(float), n));
    auto* normals = static_cast<float*>(rtcSetNewGeometryBuffer(
        discs, RTC_BUFFER_TYPE_NORMAL, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), n));
    const auto radius = static_cast<float>(0.8660254 * map.resolution());
    std::size_t i = 0;
    map.for_each_surfel([&](const Vector3d& p, const Vector3d& e0, double, std::uint32_t) {
      for (int axis = 0; axis < 3; ++axis) {
        places[4 * i + static_cast<std::size_t>(axis)] = static_cast<float>(p[axis]);
        normals[3 * i + static_cast<std::size_t>(axis)] = static_cast<float>(e0[axis]);
      }
      places[4 * i++ + 3] = radius;
    });
    rtcCommitGeometry(discs);
    rtcAttachGeometry(scene_, discs);
    rtcReleaseGeometry(discs);
    rtcCommitScene(scene_);
  }
  ~EmbreeDiscs() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  EmbreeDiscs(const EmbreeDiscs&) = delete;
  EmbreeDiscs& operator=(const EmbreeDiscs&) = delete;

  /// Sum of ranges, so that nothing is optimised away.
  [[nodiscard]] double one_by_one(std::span<const Ray> rays) const {
    EmbreeQuery query(false);
    double sum = 0.0;
    for (const Ray& ray : rays) {
      RTCRayHit hit{};
      hit.ray.org_x = static_cast<float>(ray.origin_world.x());
      hit.ray.org_y = static_cast<float>(ray.origin_world.y());
      hit.ray.org_z = static_cast<float>(ray.origin_world.z());
      hit.ray.dir_x = ray.direction_world.x();
      hit.ray.dir_y = ray.direction_world.y();
      hit.ray.dir_z = ray.direction_world.z();
      hit.ray.tfar = ray.range_max;
      hit.ray.mask = ~0u;
      hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      query.one(scene_, hit);
      sum += static_cast<double>(hit.ray.tfar);
    }
    return sum;
  }

  [[nodiscard]] double by_eight(std::span<const Ray> rays) const {
    EmbreeQuery query(true);
    double sum = 0.0;
    for (std::size_t i = 0; i + 8 <= rays.size(); i += 8) {
      alignas(32) RTCRayHit8 hit{};
      alignas(32) int valid[8];
      for (std::size_t k = 0; k < 8; ++k) {
        const Ray& ray = rays[i + k];
        valid[k] = -1;
        hit.ray.org_x[k] = static_cast<float>(ray.origin_world.x());
        hit.ray.org_y[k] = static_cast<float>(ray.origin_world.y());
        hit.ray.org_z[k] = static_cast<float>(ray.origin_world.z());
        hit.ray.dir_x[k] = ray.direction_world.x();
        hit.ray.dir_y[k] = ray.direction_world.y();
        hit.ray.dir_z[k] = ray.direction_world.z();
        hit.ray.tfar[k] = ray.range_max;
        hit.ray.mask[k] = ~0u;
        hit.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
      }
      query.eight(scene_, valid, hit);
      for (std::size_t k = 0; k < 8; ++k) sum += static_cast<double>(hit.ray.tfar[k]);
    }
    return sum;
  }

 private:
  RTCDevice device_;
  RTCScene scene_;
};

/// One way of rendering: called with the rays of one scan.
struct Contestant {
  std::string name;
  std::function<void(const RayBatch&)> render;
  int threads = 1;
  std::vector<double> seconds{};  ///< Of each scan.
};

double quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

BeamPlan plan_of(const std::string& name) {
  if (auto table = table_beams(name)) return *table;
  const LidarSettings settings = load_lidar(name);
  BeamPlan plan;
  plan.name = name;
  plan.range_max = static_cast<float>(settings.range_max);
  for (const Beam& beam : Lidar(settings, 0).beams(0, Executor(1))) {
    plan.directions_sensor.push_back(beam.direction_sensor);
  }
  return plan;
}

nlohmann::ordered_json measure(const std::shared_ptr<const SurfelMap>& map,
                               const EmbreeDiscs& embree,
                               const ExactScene& scene,
                               const BeamPlan& plan,
                               const Flags& flags) {
  const BeamRenderer beam(Scene{map});
  const BeamRenderer singly(Scene{map}, BeamGrouping::kSingly);
  const PaperRenderer paper(Scene{map}, {});
  const Executor one(1);
  const Executor two(2);
  std::vector<Hit> hits(plan.directions_sensor.size());
  volatile double sink = 0.0;
  std::vector<Contestant> contestants = {
      {"beam", [&](const RayBatch& b) { beam.render(b, hits, one); }},
      {"single", [&](const RayBatch& b) { singly.render(b, hits, one); }},
      {"embree1", [&](const RayBatch& b) { sink = sink + embree.one_by_one(b.rays); }},
      {"embree8", [&](const RayBatch& b) { sink = sink + embree.by_eight(b.rays); }},
      {"paper", [&](const RayBatch& b) { paper.render(b, hits, one); }},
      {"beam 2 threads", [&](const RayBatch& b) { beam.render(b, hits, two); }, 2},
      {"paper 2 threads", [&](const RayBatch& b) { paper.render(b, hits, two); }, 2}};
  if (!flags.contestants.empty()) {
    std::erase_if(contestants, [&](const Contestant& c) {
      return std::find(flags.contestants.begin(), flags.contestants.end(), c.name) ==
             flags.contestants.end();
    });
  }
  // a grid's beams are ordered once, as by Lidar; of others each time is measured with its sort
  std::vector<std::uint32_t> order;
  if (plan.name.ends_with("_grid")) order = direction_order(plan.directions_sensor, one);
  for (int repeat = 0; repeat < flags.repeats; ++repeat) {
    for (const Pose& pose : scene.poses) {
      std::vector<Ray> rays;
      for (const Vector3f& d : plan.directions_sensor) {
        rays.push_back(
            {pose.translation, (pose.rotation * d.cast<double>()).cast<float>(), plan.range_max});
      }
      RayBatch batch;
      batch.rays = rays;
      batch.order = order;
      batch.T_world_sensor = pose;
      batch.range_max = plan.range_max;
      for (Contestant& contestant : contestants) {
        const auto now = contestant.threads == 1 ? cpu_seconds : wall_seconds;
        const double start = now();
        contestant.render(batch);
        contestant.seconds.push_back(now() - start);
      }
    }
  }
  nlohmann::ordered_json results = nlohmann::ordered_json::array();
  const auto beams = static_cast<double>(plan.directions_sensor.size());
  std::map<std::string, double> best;
  for (const Contestant& contestant : contestants) {
    // the best repeat of each pose: what the code costs without its neighbours
    double sum = 0.0;
    for (std::size_t pose = 0; pose < scene.poses.size(); ++pose) {
      double least = 1e9;
      for (std::size_t i = pose; i < contestant.seconds.size(); i += scene.poses.size()) {
        least = std::min(least, contestant.seconds[i]);
      }
      sum += least;
    }
    const double seconds = sum / static_cast<double>(scene.poses.size());
    best[contestant.name] = seconds;
    results.push_back({{"name", contestant.name},
                       {"threads", contestant.threads},
                       {"million_beams_per_second", 1e-6 * beams / seconds},
                       {"scan_ms", 1e3 * seconds},
                       {"scan_ms_p50", 1e3 * quantile(contestant.seconds, 0.5)},
                       {"scan_ms_p99", 1e3 * quantile(contestant.seconds, 0.99)}});
  }
  fmt::print(stderr, "{:<7} {:<5} {:<15}", scene.name, map->resolution(), plan.name);
  for (const auto& row : results) {
    fmt::print(stderr,
               "  {} {:.2f} ms ({:.2f} M/s)",
               row["name"].get<std::string>(),
               row["scan_ms"].get<double>(),
               row["million_beams_per_second"].get<double>());
  }
  nlohmann::ordered_json ratios;
  const auto ratio = [&](const char* name, const char* of, const char* to) {
    if (best.count(of) == 0 || best.count(to) == 0) return;
    ratios[name] = best[to] / best[of];
    fmt::print(stderr, "  | {} {:.2f}", name, best[to] / best[of]);
  };
  ratio("single_to_embree1", "single", "embree1");
  ratio("beam_to_embree1", "beam", "embree1");
  ratio("beam_to_embree8", "beam", "embree8");
  ratio("beam_to_paper", "beam", "paper");
  ratio("beam_2_threads", "beam 2 threads", "beam");
  ratio("paper_2_threads", "paper 2 threads", "paper");
  fmt::print(stderr, "\n");
  return {{"scene", scene.name},
          {"resolution", map->resolution()},
          {"surfels", map->surfel_count()},
          {"bytes_per_surfel",
           static_cast<double>(map->file_size()) / static_cast<double>(map->surfel_count())},
          {"pattern", plan.name},
          {"beams", plan.directions_sensor.size()},
          {"ratios", ratios},
          {"results", results}};
}

void run(const Flags& flags) {
  nlohmann::ordered_json cases = nlohmann::ordered_json::array();
  for (const std::string& name : flags.scenes) {
    const ExactScene scene = load_scene(name);
    for (const double resolution : flags.resolutions) {
      const auto map =
          map_of(scene, resolution, flags.normal ? TreeQuality::kNormal : TreeQuality::kHigh);
      const EmbreeDiscs embree(*map);
      for (const std::string& pattern : flags.patterns) {
        cases.push_back(measure(map, embree, scene, plan_of(pattern), flags));
      }
    }
  }
  if (flags.json) fmt::print("{}\n", nlohmann::ordered_json{{"cases", cases}}.dump(2));
}

}  // namespace
}  // namespace pointflight

int main(int argc, char** argv) {
  pointflight::Flags flags;
  CLI::App app{"Renderers side by side on the same surfels and rays"};
  app.add_option("--scenes", flags.scenes)->delimiter(',');
  app.add_option("--resolution", flags.resolutions)->delimiter(',');
  app.add_option("--patterns", flags.patterns, "Table beams or names of LiDARs")->delimiter(',');
  app.add_option("--only", flags.contestants, "Some of: beam, embree1, embree8, paper, ...")
      ->delimiter(',');
  app.add_option("--repeats", flags.repeats);
  app.add_flag("--normal", flags.normal, "Maps as by import --quality normal");
  app.add_option("--kernel", flags.kernel, "AVX3, AVX2, SSE4 (default: the best)");
  app.add_flag("--json", flags.json, "JSON on stdout");
  CLI11_PARSE(app, argc, argv);
  try {
    pointflight::use_kernel(flags.kernel);
    pointflight::run(flags);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
  return 0;
}
