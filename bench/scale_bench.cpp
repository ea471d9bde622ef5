// How cost grows with the map: opening and the first scan with nothing in the page cache and with
// everything there, scans from many positions, and the memory of one and of ten processes on one
// map.
// `./dev bench scale MAP..`; see BENCHMARK.md.
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>

#include "pointflight/core/random.hpp"
#include "pointflight/fidelity/scene_beams.hpp"
#include "pointflight/render/internal/beam_renderer.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kPlaces = 32;

double seconds_of(const std::function<void()>& action) {
  const auto start = std::chrono::steady_clock::now();
  action();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Takes a file out of the page cache, as far as nobody has it mapped.
void forget(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return;
  ::fdatasync(file);
  ::posix_fadvise(file, 0, 0, POSIX_FADV_DONTNEED);
  ::close(file);
}

/// A free position in the map: 0.5 to 3 m from the nearest surfel.
Vector3d place_in(const SurfelMap& map, std::uint64_t number) {
  const RandomStream random(1, StreamId::kTest, 0);
  const Aabb& b = map.bounds_world();
  for (std::uint64_t attempt = 0;; ++attempt) {
    Vector3d p;
    for (int axis = 0; axis < 3; ++axis) {
      const std::uint64_t index = 3 * (1000 * number + attempt) + static_cast<std::uint64_t>(axis);
      p[axis] = random.uniform(index, b.min[axis], b.max[axis]);
    }
    const auto nearest = map.nearest(p, 3.0);
    if ((nearest && nearest->distance > 0.5) || attempt == 999) return p;
  }
}

double scan(const BeamRenderer& renderer,
            const BeamPlan& plan,
            const Vector3d& at,
            const Executor& executor) {
  std::vector<Ray> rays;
  rays.reserve(plan.directions_sensor.size());
  for (const Vector3f& d : plan.directions_sensor) rays.push_back({at, d, plan.range_max});
  std::vector<Hit> hits(rays.size());
  RayBatch batch;
  batch.rays = rays;
  return seconds_of([&] { renderer.render(batch, hits, executor); });
}

/// Kilobytes of a line of /proc/self/smaps_rollup.
double kilobytes(const std::string& key) {
  std::ifstream file("/proc/self/smaps_rollup");
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with(key)) return std::stod(line.substr(key.size()));
  }
  return 0.0;
}

/// Memory of `count` processes that each scan from the same positions: MB, on average. Pss is what
/// each takes of what all share.
nlohmann::ordered_json memory_of(const std::string& path, const BeamPlan& plan, int count) {
  int done[2];
  int look[2];
  int end[2];
  if (::pipe(done) != 0 || ::pipe(look) != 0 || ::pipe(end) != 0) return {};
  for (int i = 0; i < count; ++i) {
    if (::fork() != 0) continue;
    const auto map = SurfelMap::open(path);
    const BeamRenderer renderer(Scene{map});
    const Executor one(1);
    for (std::size_t k = 0; k < kPlaces; ++k) scan(renderer, plan, place_in(*map, k), one);
    char token = 0;
    (void)!::write(done[1], &token, 1);
    (void)!::read(look[0], &token, 1);  // all are there
    const double figures[3] = {kilobytes("Rss:"), kilobytes("Pss:"), kilobytes("Private_Dirty:")};
    (void)!::write(done[1], figures, sizeof figures);
    (void)!::read(end[0], &token, 1);  // all have looked
    ::_exit(0);
  }
  char token = 0;
  for (int i = 0; i < count; ++i) (void)!::read(done[0], &token, 1);
  for (int i = 0; i < count; ++i) (void)!::write(look[1], &token, 1);
  double sums[3] = {0.0, 0.0, 0.0};
  for (int i = 0; i < count; ++i) {
    double figures[3] = {0.0, 0.0, 0.0};
    (void)!::read(done[0], figures, sizeof figures);
    for (int k = 0; k < 3; ++k) sums[k] += 1.024e-3 * figures[k] / count;
  }
  for (int i = 0; i < count; ++i) (void)!::write(end[1], &token, 1);
  while (::wait(nullptr) > 0) continue;
  for (const int* pipe : {done, look, end}) {
    ::close(pipe[0]);
    ::close(pipe[1]);
  }
  return {{"processes", count},
          {"resident_mb", sums[0]},
          {"proportional_mb", sums[1]},
          {"own_mb", sums[2]}};
}

nlohmann::ordered_json measure(const std::string& path, const BeamPlan& plan) {
  nlohmann::ordered_json row;
  row["map"] = path;
  // processes first: this one must not have touched the map
  for (const int count : {1, 10}) row["memory"].push_back(memory_of(path, plan, count));
  const Executor two(2);
  const Executor one(1);
  Vector3d first_place;
  {
    const auto map = SurfelMap::open(path);
    first_place = place_in(*map, 0);
    row["surfels"] = map->surfel_count();
    row["bytes_per_surfel"] =
        static_cast<double>(map->file_size()) / static_cast<double>(map->surfel_count());
  }
  for (const bool cold : {true, false}) {
    if (cold) forget(path);
    std::shared_ptr<const SurfelMap> map;
    const double open = seconds_of([&] { map = SurfelMap::open(path); });
    const BeamRenderer renderer(Scene{map});
    const double first = scan(renderer, plan, first_place, two);
    row[cold ? "cold" : "warm"] = {{"open_ms", 1e3 * open}, {"first_scan_ms", 1e3 * first}};
  }
  const auto map = SurfelMap::open(path);
  const BeamRenderer renderer(Scene{map});
  std::vector<double> times;
  for (std::size_t k = 0; k < kPlaces; ++k) {
    const Vector3d at = place_in(*map, k);
    scan(renderer, plan, at, one);  // brings the pages in
    times.push_back(scan(renderer, plan, at, one));
  }
  std::sort(times.begin(), times.end());
  row["scan_ms_one_thread"] = {{"p50", 1e3 * times[times.size() / 2]}, {"p99", 1e3 * times.back()}};
  return row;
}

int run(const std::vector<std::string>& maps, bool json) {
  const BeamPlan plan = *table_beams("mid360_uniform");
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const std::string& path : maps) {
    all.push_back(measure(path, plan));
    const auto& r = all.back();
    if (json) continue;
    fmt::print(
        "{:.1f} M surfels, {:.1f} bytes each: open {:.3f} ms cold, {:.3f} warm; first scan of {} "
        "beams {:.0f} ms cold, {:.1f} warm (2 threads); scans {:.1f} ms (p99 {:.1f}) on one "
        "thread\n",
        1e-6 * r["surfels"].get<double>(),
        r["bytes_per_surfel"].get<double>(),
        r["cold"]["open_ms"].get<double>(),
        r["warm"]["open_ms"].get<double>(),
        plan.directions_sensor.size(),
        r["cold"]["first_scan_ms"].get<double>(),
        r["warm"]["first_scan_ms"].get<double>(),
        r["scan_ms_one_thread"]["p50"].get<double>(),
        r["scan_ms_one_thread"]["p99"].get<double>());
    for (const auto& m : r["memory"]) {
      fmt::print(
          "  {:2} process(es): resident {:.0f} MB each, {:.0f} MB with the shared pages "
          "divided, {:.1f} MB of its own\n",
          m["processes"].get<int>(),
          m["resident_mb"].get<double>(),
          m["proportional_mb"].get<double>(),
          m["own_mb"].get<double>());
    }
  }
  if (json) fmt::print("{}\n", all.dump(1));
  return 0;
}

}  // namespace
}  // namespace pointflight

int main(int argc, char** argv) {
  std::vector<std::string> maps;
  bool json = false;
  CLI::App app("Measures opening, first scans and memory of maps");
  app.add_option("maps", maps, ".pfmap files")->required()->check(CLI::ExistingFile);
  app.add_flag("--json", json, "Print JSON");
  CLI11_PARSE(app, argc, argv);
  try {
    return pointflight::run(maps, json);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
}
