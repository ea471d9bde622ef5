#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/cli.hpp"
#include "apps/commands.hpp"
#include "apps/error_table.hpp"
#include "apps/flags.hpp"
#include "apps/input_kind.hpp"
#include "apps/renderer_flags.hpp"
#include "apps/settings_json.hpp"
#include "apps/surroundings_flags.hpp"
#include "apps/survey_flags.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/fidelity/scan_comparison.hpp"
#include "pointflight/fidelity/scan_noise.hpp"
#include "pointflight/fidelity/sensor_comparison.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "pointflight/map/fitted_scans.hpp"
#include "pointflight/picture/error_picture.hpp"
#include "pointflight/picture/sensor_picture.hpp"
#include "pointflight/survey/scan_fingerprint.hpp"

namespace pointflight::apps {
namespace {

struct CompareFlags {
  std::string map;
  ScansFlags scans;
  std::string cloud;
  RendererFlags renderer{"beam", ""};
  bool floor = false;
  std::string lidar;
  Surroundings surroundings;
  std::string png;
  bool force = false;
  bool json = false;
  int threads = 0;
};

/// A picture of where a scan's errors sit.
void draw_scan_errors(const RealScan& scan,
                      const std::vector<ComparedRay>& rays,
                      bool supported_only,
                      const std::string& folder) {
  picture::ErrorPanel panel{supported_only ? "rays that the cloud supports" : "all rays", {}};
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (supported_only && !rays[i].supported) continue;
    const Vector3f p = scan.point_sensor(i);
    panel.marks.push_back({std::atan2(p.y(), p.x()),
                           std::atan2(p.z(), std::hypot(p.x(), p.y())),
                           rays[i].range,
                           rays[i].rendered});
  }
  const std::string stem = std::filesystem::path(scan.name).stem().string();
  picture::draw_errors({&panel, 1}, scan.name, folder + "/" + stem + ".png");
}

/// The real scans among themselves: what no renderer can better.
ErrorCollector compare_floor(const std::vector<RealScan>& scans,
                             const Executor& executor,
                             const Progress& progress) {
  const ScanPlanes planes(scans);
  ErrorCollector floor;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    report(progress,
           "scans among themselves",
           static_cast<double>(i) / static_cast<double>(scans.size()));
    floor.add(planes.compare(i, executor));
  }
  return floor;
}

nlohmann::ordered_json sensor_json(const SensorComparison& made) {
  const auto of_sides = [](const Sides& sides) {
    return nlohmann::ordered_json{
        {"real", sides.real}, {"modelled", sides.modelled}, {"plain", sides.plain}};
  };
  nlohmann::ordered_json shares = nlohmann::ordered_json::array();
  for (std::size_t r = 0; r < made.shares.size(); ++r) {
    for (std::size_t i = 0; i < made.shares[r].size(); ++i) {
      const ReturnShare& share = made.shares[r][i];
      if (share.beams <= 0.0) continue;
      shares.push_back({{"range", {SensorComparison::kRanges[r], SensorComparison::kRanges[r + 1]}},
                        {"incidence_deg",
                         {SensorComparison::kIncidences[i], SensorComparison::kIncidences[i + 1]}},
                        {"beams", share.beams},
                        {"returns", of_sides(share.returns)}});
    }
  }
  nlohmann::ordered_json edges = nlohmann::ordered_json::array();
  for (const Sides& bin : made.edges) edges.push_back(of_sides(bin));
  const Sides share = made.share_distance();
  const Sides edge = made.edge_distance();
  return {{"beams", made.beams},
          {"returns", made.returns},
          {"back", of_sides(made.back)},
          {"blocked_beams", made.blocked},
          {"least_range", made.least_range},
          {"share_distance", {{"modelled", share.modelled}, {"plain", share.plain}}},
          {"edge_distance", {{"modelled", edge.modelled}, {"plain", edge.plain}}},
          {"shares", shares},
          {"edge_error_limits", SensorComparison::kErrors},
          {"edges", edges}};
}

nlohmann::ordered_json noise_json(const NoiseComparison& noise) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (std::size_t k = 0; k < noise.bins.size(); ++k) {
    const PlaneNoise& bin = noise.bins[k];
    if (!NoiseComparison::counts(bin)) continue;
    rows.push_back({{"range", {NoiseComparison::kRanges[k], NoiseComparison::kRanges[k + 1]}},
                    {"real", bin.real},
                    {"modelled", bin.modelled},
                    {"real_points", bin.real_points},
                    {"modelled_points", bin.modelled_points}});
  }
  return rows;
}

void print_noise(const NoiseComparison& noise) {
  fmt::print("\nranges off planes, mm: real / by the model\n");
  for (std::size_t k = 0; k < noise.bins.size(); ++k) {
    const PlaneNoise& bin = noise.bins[k];
    if (!NoiseComparison::counts(bin)) continue;
    fmt::print(
        "{:>10}{:>14}\n",
        fmt::format("{:g}-{:g}", NoiseComparison::kRanges[k], NoiseComparison::kRanges[k + 1]),
        fmt::format("{:.1f} / {:.1f}", 1e3 * bin.real, 1e3 * bin.modelled));
  }
}

std::string nearer(const Sides& distance) {
  if (distance.plain <= 0.0) return "";
  return fmt::format(": {:.0f} % nearer", 100.0 * (1.0 - distance.modelled / distance.plain));
}

/// Rows of ranges, columns of incidences: real and modelled shares of returns, %.
void print_sensor(const SensorComparison& made) {
  fmt::print("\nbeams that come back, %: real / by the model; columns: incidence, degrees\n{:>10}",
             "range, m");
  for (std::size_t i = 0; i + 1 < SensorComparison::kIncidences.size(); ++i) {
    fmt::print(
        "{:>11}",
        fmt::format(
            "{:g}-{:g}", SensorComparison::kIncidences[i], SensorComparison::kIncidences[i + 1]));
  }
  fmt::print("\n");
  for (std::size_t r = 0; r < made.shares.size(); ++r) {
    const auto& row = made.shares[r];
    if (std::none_of(row.begin(), row.end(), SensorComparison::counts)) continue;
    fmt::print(
        "{:>10}",
        fmt::format("{:g}-{:g}", SensorComparison::kRanges[r], SensorComparison::kRanges[r + 1]));
    for (const ReturnShare& share : row) {
      fmt::print("{:>11}",
                 SensorComparison::counts(share)
                     ? fmt::format("{:.0f} / {:.0f}",
                                   100.0 * share.returns.real / share.beams,
                                   100.0 * share.returns.modelled / share.beams)
                     : "");
    }
    fmt::print("\n");
  }
  const auto percent = [&](double back) { return 100.0 * back / std::max(1.0, made.beams); };
  fmt::print(
      "of {} beams {:.1f} % come back in reality, {:.1f} % by the model, {:.1f} % without it\n",
      short_count(made.beams),
      percent(made.back.real),
      percent(made.back.modelled),
      percent(made.back.plain));
  const Sides share = made.share_distance();
  const Sides edge = made.edge_distance();
  double at_edges = 0.0;
  for (const Sides& bin : made.edges) at_edges += bin.real;
  fmt::print("mean difference from the real share: {:.3f} by the model, {:.3f} without it{}\n",
             share.modelled,
             share.plain,
             nearer(share));
  fmt::print(
      "errors of {:.0f} returns at edges, half the sum of differences from their real "
      "distribution: "
      "{:.3f} by the model, {:.3f} without it{}\n",
      at_edges,
      edge.modelled,
      edge.plain,
      nearer(edge));
  if (static_cast<double>(made.returns) > made.beams) {
    log(fmt::format(
        "warning: {} real returns of {:.0f} beams: is it this sensor, with these columns "
        "(rings.columns of its file)?",
        made.returns,
        made.beams));
  }
}

/// How many of the scans the map was fitted to.
std::size_t count_fitted(const std::vector<RealScan>& scans, const SurfelMap& map) {
  const std::vector<std::uint64_t> fitted = fitted_scans(map);
  return static_cast<std::size_t>(
      std::count_if(scans.begin(), scans.end(), [&](const RealScan& scan) {
        return std::binary_search(fitted.begin(), fitted.end(), scan_fingerprint(scan.rays));
      }));
}

void compare(const CompareFlags& flags) {
  const PictureFolder pictures(flags.png, flags.force);
  const Executor executor(flags.threads);
  require_kind(flags.map, {InputKind::kMap}, "a map (.pfmap)");
  const auto map = SurfelMap::open(flags.map);
  std::optional<LidarSettings> lidar;
  if (!flags.lidar.empty()) lidar = load_lidar(flags.lidar);
  const Progress progress = interruptible_progress();
  const auto scans = read_real_scans(*open_survey(flags.scans, progress), progress);
  end_progress();
  std::optional<SupportedCells> cloud;
  if (!flags.cloud.empty()) cloud = supported_by_cloud(flags.cloud);
  choose_renderer(flags.renderer);
  const auto renderer = make_renderer(flags.renderer.renderer, Scene{map});
  ErrorCollector all;
  ErrorCollector supported;
  ErrorCollector assumed;
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  const ErrorTable table;
  const std::size_t fitted = count_fitted(scans, *map);
  if (fitted > 0) {
    log(
        fmt::format("{} of the {} scans are among those that the map was fitted to: of these the "
                    "figures say how well it was fitted, not how true it is",
                    fitted,
                    scans.size()));
  }
  if (!flags.json) table.print_heading();
  for (std::size_t i = 0; i < scans.size(); ++i) {
    report(progress, "comparing", static_cast<double>(i) / static_cast<double>(scans.size()));
    const auto rays = compare_scan(scans[i], *renderer, *map, cloud ? &*cloud : nullptr, executor);
    const ErrorCollector scan_all = collect(rays, [](const ComparedRay&) { return true; });
    const ErrorCollector scan_supported =
        collect(rays, [](const ComparedRay& ray) { return ray.supported; });
    assumed.add(collect(rays, [](const ComparedRay& ray) { return ray.assumed; }));
    all.add(scan_all);
    supported.add(scan_supported);
    rows.push_back({{"file", scans[i].name},
                    {"all", table.json(scan_all.statistics())},
                    {"supported", table.json(scan_supported.statistics())}});
    if (!flags.json) table.print_row(scans[i].name, scan_all.statistics());
    if (!flags.png.empty()) draw_scan_errors(scans[i], rays, cloud.has_value(), flags.png);
  }
  std::optional<ErrorCollector> floor;
  if (flags.floor) floor = compare_floor(scans, executor, progress);
  std::optional<SensorComparison> sensor;
  std::optional<NoiseComparison> noise;
  if (lidar) {
    const Surroundings where = surroundings_in(*map, flags.surroundings);
    sensor = compare_sensor(scans, *lidar, where, *renderer, executor, progress);
    noise = compare_noise(scans, *lidar, where, *renderer, executor, progress);
    if (!flags.png.empty()) {
      picture::draw_sensor_comparison(
          *sensor, flags.lidar + " beside real scans", flags.png + "/sensor.png");
    }
  }
  end_progress();
  say_gpu_notices();
  if (flags.json) {
    nlohmann::ordered_json json = {{"overall",
                                    {{"all", table.json(all.statistics())},
                                     {"supported", table.json(supported.statistics())}}},
                                   {"scans", rows},
                                   {"fitted_scans", fitted}};
    if (map->has_assumed()) json["overall"]["assumed"] = table.json(assumed.statistics());
    if (floor) json["floor"] = table.json(floor->statistics());
    if (sensor) json["sensor"] = sensor_json(*sensor);
    if (noise) json["sensor"]["noise"] = noise_json(*noise);
    print_json(json);
    return;
  }
  table.print_row("all", all.statistics());
  if (cloud) table.print_row("all, supported", supported.statistics());
  if (map->has_assumed()) table.print_row("all, on what is assumed", assumed.statistics());
  if (floor) table.print_row("scans among themselves", floor->statistics());
  if (sensor) print_sensor(*sensor);
  if (noise) print_noise(*noise);
}

}  // namespace

void add_compare_command(CLI::App& parent, int& /*exit_code*/) {
  auto* app = parent.add_subcommand("compare",
                                    "Render real scans' rays from a map and say how they differ");
  auto flags = std::make_shared<CompareFlags>();
  app->add_option("map", flags->map, "A .pfmap")->required();
  add_scans_flags(*app, flags->scans, true);
  app->add_option("--cloud",
                  flags->cloud,
                  "The cloud that the map was made from: also restricts the comparison to rays "
                  "that it supports: one of its points lies within 0.1 m of the return");
  add_renderer_flags(*app, flags->renderer, "How ranges are made");
  app->add_flag(
      "--floor",
      flags->floor,
      "Also compare each scan with local planes of the other scans: the best that the data allow");
  auto* lidar = app->add_option(
      "--lidar",
      flags->lidar,
      "What took the scans: also how many beams come back by range and incidence, and where they "
      "lie at edges, beside what its sensor file says; the scans must be whole");
  for (CLI::Option* option : add_surroundings_flags(*app, flags->surroundings)) {
    option->needs(lidar);
  }
  app->add_option("--png", flags->png, "Folder for pictures of each scan's errors");
  add_force_flag(*app, flags->force);
  app->add_flag("--json", flags->json, "JSON on stdout");
  app->add_option("--threads", flags->threads, "0: all cores")->check(CLI::Range(0, 1024));
  app->footer(
      "Example: pointflight compare hall.pfmap --scans scans/ --poses poses.tum --png errors");
  app->callback([flags] { compare(*flags); });
}

}  // namespace pointflight::apps
