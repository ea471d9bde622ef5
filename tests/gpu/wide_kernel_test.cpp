// The kernel of wide beams as C++ beside the processor's own.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>

#include "pointflight/gpu/internal/kernel_choice.hpp"
#include "pointflight/gpu/internal/wide_tables.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/map/map_file.hpp"
#include "pointflight/render/internal/beam_renderer.hpp"
#include "pointflight/render/internal/cone_kernel.hpp"
#include "tests/gpu/aimed_call.hpp"
#include "tests/gpu/kernel_as_cpp.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

/// A call of one aim, as a device has it in its buffers.
struct WideCall {
  WideCall(const SurfelMap& map, const AimedBeams& aim, const WideBeams& wide)
      : given(testing::given_of(kernel_map_of(map), aim)) {
    const Reflectances reflectances = wide.receiver->reflectances();
    tables = wide_tables(map, reflectances);
    codes.resize(map.intensity_codes().size() / 4 + 1);
    std::memcpy(codes.data(), map.intensity_codes().data(), map.intensity_codes().size());
    kernel->map = numbers_of(map);
    kernel->nodes = reinterpret_cast<const device::uvec4*>(map.nodes().data());
    kernel->words = reinterpret_cast<const device::uvec2*>(map.words().data());
    const auto count = static_cast<std::uint32_t>(aim.beams->beams.size());
    kernel->call.count = count;
    kernel->call.beams = count;
    kernel->call.has_origins = aim.beams->has_origins ? 1 : 0;
    kernel->call.sigma_across = wide.sigma_across;
    kernel->call.sigma_up = wide.sigma_up;
    kernel->call.per_intensity = reflectances.per_intensity;
    kernel->call.same = reflectances.same;
    kernel->call.least = reflectances.least;
    kernel->given = given.data();
    kernel->beams = reinterpret_cast<const device::DeviceBeam*>(aim.beams->beams.data());
    kernel->tables = tables.data();
    kernel->codes = codes.data();
  }
  std::vector<std::uint32_t> given;
  std::vector<std::uint32_t> tables;
  std::vector<std::uint32_t> codes;
  std::unique_ptr<device::KernelAsCpp> kernel = std::make_unique<device::KernelAsCpp>();
};

bool are_same(const Echo& a, const Echo& b) {
  return a.range == b.range && a.reflectivity == b.reflectivity && a.intensity == b.intensity &&
         a.parts == b.parts && a.depth == b.depth &&
         a.origin.cos_incidence == b.origin.cos_incidence && a.origin.surfel == b.origin.surfel &&
         a.origin.sub_ray == b.origin.sub_ray;
}

bool are_same(const Echoes& a, const Echoes& b) {
  if (a.count != b.count || a.all_hit != b.all_hit) return false;
  for (std::uint32_t i = 0; i < a.count; ++i) {
    if (!are_same(a.all[i], b.all[i])) return false;
  }
  return true;
}

/// What the kernel leaves of a beam to do.
enum class Left { kNothing, kMarginal, kMore, kAll };

/// The echoes of beam `i` by the kernel and what follows it.
Left echoes_by_kernel(const SurfelMap& map,
                      const WideBeams& wide,
                      device::KernelAsCpp& kernel,
                      std::uint32_t i,
                      Echoes& echoes) {
  const device::WideResult result = kernel.trace_wide(i);
  if (result.kind == device::kLeftToProcessor) return Left::kAll;
  echoes.count = 0;
  echoes.all_hit = false;
  if (result.kind == device::kNoEcho) return Left::kNothing;
  if (result.kind == device::kOneEchoOfAll) {
    echoes.count = 1;
    echoes.all_hit = true;
    echoes.all[0] = {};
    echoes.all[0].range = result.range;
    echoes.all[0].reflectivity = result.reflectivity;
    echoes.all[0].intensity = result.intensity;
    echoes.all[0].parts = 8;
    echoes.all[0].depth = result.depth;
    echoes.all[0].origin = {
        result.cosine, result.surfel, static_cast<std::uint16_t>(result.sub_ray)};
    return is_sure_of(wide, echoes.all[0]) ? Left::kNothing : Left::kMarginal;
  }
  SecondLevel second{};
  const std::uint32_t table = kernel.second_level();
  second.direction = (table - device::kAtSecond) / 64;
  float nearest = device::kNever;
  for (std::uint32_t k = 0; k < device::kSecondLevel; ++k) {
    kernel.see_sub_ray(kernel.table_float(table + 2 * k), kernel.table_float(table + 2 * k + 1));
    kernel.hit_sub_ray();
    second.ranges[k] = kernel.sub_range;
    second.cosines[k] = kernel.sub_cosine;
    second.words[k] = static_cast<std::uint32_t>(kernel.sub_word);
    nearest = std::min(nearest, kernel.sub_range);
  }
  if (!kernel.c.is_lossless) return Left::kAll;
  second.has_before = kernel.has_before(nearest);
  return find_second_level_echoes(map, wide, second, echoes) ? Left::kNothing : Left::kMore;
}

/// Shares of beams by `Left`, all of which have the processor's echoes as far as they go.
std::array<double, 4> expect_equal(const std::shared_ptr<const SurfelMap>& map,
                                   const std::string& sensor,
                                   const PoseTrack& track,
                                   const Surroundings& surroundings) {
  const BeamRenderer beam(Scene{map});
  const Lidar lidar(load_lidar(sensor), 0, nullptr, surroundings);
  const Executor executor(2);
  std::array<double, 4> shares{};
  std::size_t beams = 0;
  std::size_t different = 0;
  for (std::uint64_t k = 0; k < 2; ++k) {
    ScanRequest request;
    request.index = k;
    request.start = SimTime{} + static_cast<std::int64_t>(k) * lidar.period();
    request.seed = 2;
    const auto exposure = lidar.aim(request, track, beam, executor);
    const RenderJob job = exposure->job();
    beam.render({&job, 1}, executor);
    WideCall call(*map, *job.batch.aimed, *job.wide);
    for (std::uint32_t i = 0; i < job.batch.size(); ++i) {
      Echoes echoes;
      const Left left = echoes_by_kernel(*map, *job.wide, *call.kernel, i, echoes);
      shares[static_cast<std::size_t>(left)] += 1.0;
      ++beams;
      if (left == Left::kNothing && !are_same(echoes, job.wide->echoes[i])) {
        if (different++ < 5) {
          const Echoes& e = job.wide->echoes[i];
          ADD_FAILURE() << sensor << " beam " << i << ": " << echoes.count << " echoes, "
                        << echoes.all[0].range << " m of " << echoes.all[0].parts << "; processor "
                        << e.count << ", " << e.all[0].range << " m of " << e.all[0].parts;
        }
      }
    }
  }
  EXPECT_EQ(different, 0u) << sensor << " of " << beams;
  for (double& share : shares) share /= static_cast<double>(beams);
  ::testing::Test::RecordProperty(sensor + "_done", fmt::format("{:.4f}", shares[0]));
  return shares;
}

PoseTrack through(const Vector3d& from, const Vector3d& velocity) {
  std::vector<TimedPose> records;
  for (int i = 0; i <= 400; ++i) {
    const double t = 1e-3 * i;
    records.push_back(
        {SimTime{} + from_seconds(t),
         {Quaterniond(Eigen::AngleAxisd(2.0 * t, Vector3d(0.1, -0.2, 1).normalized())),
          from + t * velocity}});
  }
  return PoseTrack(std::move(records));
}

TEST(GpuWideKernel, TrialSceneHasTheProcessorsEchoes) {
  const PoseTrack track = through({3.0, 3.0, 1.2}, {2.0, 0.5, 1.0});
  for (const char* sensor : {"mid360", "avia", "vlp16"}) {
    const auto shares = expect_equal(trial_scene(), sensor, track, Surroundings{});
    EXPECT_GT(shares[0], 0.99) << sensor;
  }
}

TEST(GpuWideKernel, AMadeForestHasTheProcessorsEchoes) {
  // sparse: twigs and ground of few points, which beams touch at their fringes
  ForestOptions forest;
  forest.size_x = 24.0;
  forest.size_y = 20.0;
  const auto map = testing::map_of(make_forest(forest), 0.1, 3.0, 0.01);
  for (int k = 0; k < testing::repeats(20); ++k) {
    const PoseTrack track = through({12.0 + 0.03 * k, 10.0, 4.0}, {0.1, 0.05, 0.0});
    expect_equal(map, "mid360", track, Surroundings{});
  }
}

TEST(GpuWideKernel, RealPlacesHaveTheProcessorsEchoes) {
  const std::string cloud = testing::shared_data("maps/forest_tls.pcd");
  SKIP_WITHOUT(cloud);
  ImportOptions options;
  options.resolution = 0.1;
  const ImportedMap made = import_clouds({{cloud}}, options, Executor(2));
  const auto map = SurfelMap::from_bytes(map_bytes(made.tree, made.description), "forest");
  const Aabb& box = map->bounds_world();
  const Vector3d middle = 0.5 * (box.min + box.max);
  const PoseTrack track = through({middle.x(), middle.y(), box.min.z() + 3.0}, {2.0, 1.0, 0.3});
  for (const char* sensor : {"mid360", "os1_128"}) {
    const auto shares = expect_equal(map, sensor, track, Surroundings{});
    EXPECT_GT(shares[0], 0.97) << sensor;
  }
}

}  // namespace
}  // namespace pointflight
