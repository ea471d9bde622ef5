// How near wide beams as they ship come to a thousand sub-rays each: the shares of their echoes,
// and which returns are reported. `./dev bench accuracy MAP X,Y,Z`; see BENCHMARK.md.
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/parallel.hpp"
#include "pointflight/core/random.hpp"
#include "pointflight/lidar/footprint.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "pointflight/lidar/return_model.hpp"
#include "pointflight/render/renderer.hpp"

namespace pointflight {
namespace {

constexpr std::int64_t kManySubRays = 1000;
constexpr double kReflectivity = 0.3;  // everywhere, where shares are compared
constexpr float kSameEcho = 0.4f;      // m: echoes of both that are so near are one
constexpr float kSameReturn = 0.1f;    // m
constexpr float kDeep = 0.4f;          // m: an echo from more than one thing

/// Neighbours of a scan, as its LiDAR sends them out.
struct SomeBeams {
  std::vector<Ray> rays;
  std::vector<Vector3f> across;
};

/// Some `wanted` beams in runs of 512 that follow each other in the order of rendering.
SomeBeams some_beams(const LidarSettings& settings,
                     const Vector3d& position,
                     const Renderer& renderer,
                     std::size_t wanted,
                     const Executor& executor) {
  const Lidar lidar(settings, 0, nullptr, Surroundings{});
  ScanRequest request;
  request.noise = false;
  const PoseTrack still(Pose{Quaterniond::Identity(), position});
  const auto scan = lidar.aim(request, still, renderer, executor);
  const RenderJob job = scan->job();
  std::vector<std::uint32_t> order(job.batch.order.begin(), job.batch.order.end());
  if (order.empty()) {
    order.resize(job.batch.rays.size());
    std::iota(order.begin(), order.end(), 0u);
  }
  constexpr std::size_t kRun = 512;
  const std::size_t every = std::max<std::size_t>(1, order.size() / wanted);
  SomeBeams some;
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i / kRun % every != 0) continue;
    some.rays.push_back(job.batch.rays[order[i]]);
    some.across.push_back(job.wide->across[order[i]]);
  }
  return some;
}

std::vector<Echoes> echoes_with(const Renderer& renderer,
                                const SomeBeams& beams,
                                const OpticsSettings& optics,
                                const ReturnModel& receiver,
                                const Executor& executor) {
  std::vector<Echoes> echoes(beams.rays.size());
  RayBatch batch;
  batch.rays = beams.rays;
  batch.range_max = beams.rays.front().range_max;
  const RenderJob job{batch, {}, Footprint(optics).beams(beams.across, receiver, echoes)};
  renderer.render({&job, 1}, executor);
  return echoes;
}

/// The largest error of an echo's share of the beam; an echo that only one of them has counts
/// whole.
double share_error(const Echoes& truth, const Echoes& shipped) {
  double most = 0.0;
  std::array<bool, Echoes::kMost> used{};
  for (const Echo& echo : truth.span()) {
    std::size_t best = Echoes::kMost;
    float nearest = kSameEcho;
    for (std::size_t k = 0; k < shipped.count; ++k) {
      const float away = std::abs(shipped.all[k].range - echo.range);
      if (used[k] || away >= nearest) continue;
      nearest = away;
      best = k;
    }
    double error = echo.reflectivity;
    if (best < Echoes::kMost) {
      used[best] = true;
      error = std::abs(error - static_cast<double>(shipped.all[best].reflectivity));
    }
    most = std::max(most, error);
  }
  for (std::size_t k = 0; k < shipped.count; ++k) {
    if (!used[k]) most = std::max(most, static_cast<double>(shipped.all[k].reflectivity));
  }
  return most / kReflectivity;
}

/// Hits more than one thing.
bool is_edge(const Echoes& echoes) {
  return echoes.count > 1 || (echoes.count == 1 && echoes.all[0].depth > kDeep);
}

/// What is reported of echoes without noise; the same draws of detection whatever the echoes are.
std::vector<Return> reported(const std::vector<Echoes>& echoes, const ReturnModel& model) {
  const RandomStream random(1, StreamId::kTest, 0);
  const std::vector<double> none(echoes.size(), 0.0);
  std::vector<double> detection(echoes.size());
  constexpr std::size_t kDraws = 8;  // of a beam
  for (std::size_t i = 0; i < echoes.size(); ++i) detection[i] = random.uniform(kDraws * i);
  const auto more = [&](std::size_t beam, std::size_t echo) {
    return EchoChance{.detection = random.uniform(kDraws * beam + echo)};
  };
  std::vector<Return> returns(echoes.size() * most_returns(model.mode()));
  model.measure(std::span<const Echoes>(echoes), {none, detection, none, more}, returns);
  return returns;
}

bool differ(const Return& a, const Return& b) {
  if (a.is_return() != b.is_return()) return true;
  return a.is_return() && std::abs(a.true_range - b.true_range) > kSameReturn;
}

void compare(const Renderer& renderer,
             const char* name,
             const Vector3d& position,
             std::size_t wanted,
             const Executor& executor) {
  LidarSettings settings = load_lidar(name);
  settings.optics.sub_rays = 0;
  settings.detection.false_alarm = 0.0;
  OpticsSettings many = settings.optics;
  many.sub_rays = kManySubRays;
  Surroundings even;
  even.reflectivity = kReflectivity;
  const ReturnModel of_even(settings, even);
  const ReturnModel of_varied(settings, {});
  const SomeBeams beams = some_beams(settings, position, renderer, wanted, executor);

  const auto even_truth = echoes_with(renderer, beams, many, of_even, executor);
  const auto even_shipped = echoes_with(renderer, beams, settings.optics, of_even, executor);
  std::vector<double> errors;
  for (std::size_t i = 0; i < even_truth.size(); ++i) {
    if (!is_edge(even_truth[i]) && even_shipped[i].count <= 1) continue;
    errors.push_back(share_error(even_truth[i], even_shipped[i]));
  }
  std::sort(errors.begin(), errors.end());
  const double mean = std::accumulate(errors.begin(), errors.end(), 0.0) /
                      std::max(1.0, static_cast<double>(errors.size()));
  const double high = errors.empty() ? 0.0 : errors[errors.size() * 19 / 20];

  const auto truth = reported(echoes_with(renderer, beams, many, of_varied, executor), of_varied);
  const auto shipped =
      reported(echoes_with(renderer, beams, settings.optics, of_varied, executor), of_varied);
  const std::size_t most = most_returns(of_varied.mode());
  std::size_t others = 0;
  for (std::size_t i = 0; i < beams.rays.size(); ++i) {
    bool other = false;
    for (std::size_t k = 0; k < most; ++k) {
      other = other || differ(truth[i * most + k], shipped[i * most + k]);
    }
    others += other ? 1 : 0;
  }
  const auto count = static_cast<double>(beams.rays.size());
  fmt::print("{:<10} {:>8} {:>11.1f} {:>12.4f} {:>12.3f} {:>12.2f}\n",
             name,
             beams.rays.size(),
             100.0 * static_cast<double>(errors.size()) / count,
             mean,
             high,
             100.0 * static_cast<double>(others) / count);
}

void bench(const std::string& path, const std::vector<double>& at, std::size_t wanted) {
  const auto renderer = make_renderer("beam", Scene{SurfelMap::open(path)});
  const Executor executor(0);
  fmt::print("{:<10} {:>8} {:>11} {:>12} {:>12} {:>12}\n",
             "sensor",
             "beams",
             "at edges, %",
             "share, mean",
             "share, 95 %",
             "reported, %");
  for (const char* name : {"os1_128", "vlp32c", "mid360", "avia"}) {
    compare(*renderer, name, {at[0], at[1], at[2]}, wanted, executor);
  }
}

}  // namespace
}  // namespace pointflight

int main(int argc, char** argv) {
  CLI::App app("How near wide beams come to a thousand sub-rays each");
  std::string map;
  std::vector<double> at = {0.0, 0.0, 1.0};
  std::size_t beams = 8000;
  app.add_option("map", map, "A .pfmap")->required();
  app.add_option("position", at, "x,y,z of the sensor")->delimiter(',')->expected(3);
  app.add_option("--beams", beams, "Of each sensor, about")->check(CLI::Range(1, 10'000'000));
  CLI11_PARSE(app, argc, argv);
  try {
    pointflight::bench(map, at, beams);
  } catch (const pointflight::InputError& e) {
    fmt::print(stderr, "accuracy_bench: {}\n", e.what());
    return 2;
  }
}
