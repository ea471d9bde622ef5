#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/cli.hpp"
#include "apps/commands.hpp"
#include "apps/flags.hpp"
#include "apps/input_kind.hpp"
#include "apps/renderer_flags.hpp"
#include "apps/settings_json.hpp"
#include "apps/surroundings_flags.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/output_file.hpp"
#include "pointflight/lidar/lidar.hpp"
#include "pointflight/picture/pictures.hpp"

namespace pointflight::apps {
namespace {

struct ScanFlags {
  std::string map;
  std::string lidar = "mid360";
  std::string pose;
  std::int64_t sub_rays = -1;
  std::string returns;
  RendererFlags renderer{"beam", ""};
  std::uint64_t seed = 1;
  std::uint64_t index = 0;
  bool no_noise = false;
  Surroundings surroundings;
  bool mark_unknown = false;
  bool truth = false;
  std::string output;
  std::string png;
  bool json = false;
  bool force = false;
  int threads = 0;
};

void print_scan(const Scan& scan, const ScanFlags& flags) {
  std::vector<float> ranges;
  for (const ScanPoint& point : scan.points) ranges.push_back(point.range);
  std::sort(ranges.begin(), ranges.end());
  const auto at = [&](double share) {
    return ranges.empty()
               ? 0.0f
               : ranges[static_cast<std::size_t>(share * static_cast<double>(ranges.size() - 1))];
  };
  const auto further = std::count_if(
      scan.points.begin(), scan.points.end(), [](const ScanPoint& p) { return p.echo > 0; });
  const auto unknown = std::count_if(
      scan.points.begin(), scan.points.end(), [](const ScanPoint& p) { return p.is_unknown; });
  if (flags.json) {
    nlohmann::ordered_json json;
    json["lidar"] = flags.lidar;
    json["renderer"] = flags.renderer.renderer;
    json["seed"] = flags.seed;
    json["beams"] = scan.beams;
    json["points"] = scan.points.size();
    json["range_min"] = at(0.0);
    json["range_median"] = at(0.5);
    json["range_max"] = at(1.0);
    if (scan.marks.echoes) json["further_returns"] = further;
    if (scan.marks.unknown) json["unknown"] = unknown;
    if (!flags.output.empty()) json["file"] = flags.output;
    print_json(json);
    return;
  }
  fmt::print("{} of {} beams returned; range {:.2f} to {:.2f} m, median {:.2f} m\n",
             scan.points.size() - static_cast<std::size_t>(further),
             scan.beams,
             at(0.0),
             at(1.0),
             at(0.5));
  if (scan.marks.echoes) fmt::print("{} further returns of the same beams\n", further);
  if (!scan.marks.unknown) return;
  fmt::print("{} ({:.1f} %) came through space that no survey saw\n",
             unknown,
             100.0 * static_cast<double>(unknown) /
                 static_cast<double>(std::max<std::size_t>(1, scan.points.size())));
}

void take_scan(const ScanFlags& flags) {
  const Pose pose = parse_pose(flags.pose, "--pose");
  check_outputs({flags.output, flags.png}, {flags.map, flags.lidar}, flags.force);
  require_kind(flags.map, {InputKind::kMap}, "a map (.pfmap)");
  const auto map = SurfelMap::open(flags.map);
  LidarSettings settings = load_lidar(flags.lidar);
  if (flags.sub_rays >= 0) settings.optics.sub_rays = flags.sub_rays;
  for (const Named<ReturnMode>& mode : return_modes()) {
    if (flags.returns == mode.name) settings.detection.returns = mode.value;
  }
  const Lidar lidar(settings, 0, nullptr, surroundings_in(*map, flags.surroundings));
  choose_renderer(flags.renderer);
  const auto renderer = make_renderer(flags.renderer.renderer, Scene{map});
  const Executor executor(flags.threads);
  ScanRequest request;
  request.index = flags.index;
  request.start = SimTime(static_cast<std::int64_t>(flags.index) * lidar.period());
  request.noise = !flags.no_noise;
  request.seed = flags.seed;
  request.truth = flags.truth;
  request.map = map.get();
  if (flags.mark_unknown) request.known = &known_space_of(*map);
  const Scan scan = lidar.take(request, PoseTrack(pose), *renderer, executor);
  say_gpu_notices();
  if (scan.points.empty()) {
    log("no beam hit anything: is the pose inside the map? (pointflight map info shows its "
        "extent)");
  }
  OutputSet outputs;
  if (!flags.output.empty()) write_scan_pcd(flags.output, scan);
  if (!flags.png.empty()) {
    const std::uint64_t index = lidar.pattern_scan(flags.index, flags.seed);
    picture::draw_scan(lidar.beams(index, executor), scan, settings, {*map, pose}, flags.png);
  }
  outputs.commit();
  print_scan(scan, flags);
}

}  // namespace

void add_scan_command(CLI::App& parent, int& /*exit_code*/) {
  auto* app = parent.add_subcommand("scan", "Take one scan from one pose");
  auto flags = std::make_shared<ScanFlags>();
  app->add_option("map", flags->map, "A .pfmap")->required();
  app->add_option(
         "--lidar",
         flags->lidar,
         "A shipped sensor, a .yaml file, Ouster's metadata (.json) or a Livox table (.csv)")
      ->capture_default_str();
  app->add_option("--pose",
                  flags->pose,
                  "x,y,z[,roll,pitch,yaw] of the sensor in the world: metres, degrees")
      ->required();
  add_renderer_flags(*app, flags->renderer, "How points are made");
  app->add_option("--seed", flags->seed, "Of the noise")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app->add_option("--index",
                  flags->index,
                  "Which scan: of a pattern that does not repeat, and of what changes with time")
      ->check(CLI::Range(0, 1 << 26));
  app->add_flag("--no-noise", flags->no_noise, "Exact ranges");
  add_surroundings_flags(*app, flags->surroundings);
  app->add_option(
         "--sub-rays",
         flags->sub_rays,
         "Rays over each beam's cross-section: 0: as many as it takes, 1: beams are lines, "
         "-1: as the sensor file says")
      ->check(CLI::Range(-1, 4096))
      ->capture_default_str();
  std::vector<std::string> modes;
  for (const Named<ReturnMode>& mode : return_modes()) modes.emplace_back(mode.name);
  app->add_option("--returns",
                  flags->returns,
                  "Which echoes of a beam are reported, instead of the sensor file's: one, or dual "
                  "(strongest and last), or triple")
      ->check(CLI::IsMember(modes));
  auto* output = app->add_option(
      "-o,--output",
      flags->output,
      "PCD of the points in the sensor frame: x y z intensity range time ring label; echo, "
      "where beams may have several");
  app->add_flag(
         "--truth",
         flags->truth,
         "The PCD also says what the simulator knows of each point: true_range incidence "
         "depth deskewed_x deskewed_y deskewed_z surfel thing sub_ray sub_rays assumed class")
      ->needs(output);
  app->add_flag("--mark-unknown",
                flags->mark_unknown,
                "Points say whether they came through space that no survey saw (field unknown, 0 "
                "or 1); for maps made or fitted with --scans");
  app->add_option("--png", flags->png, "Picture: range over azimuth and elevation");
  app->add_flag("--json", flags->json, "JSON on stdout");
  add_force_flag(*app, flags->force);
  app->add_option("--threads", flags->threads, "0: all cores")->check(CLI::Range(0, 1024));
  app->footer(
      "Example: pointflight scan forest.pfmap --lidar mid360 --pose 0,0,2,0,0,0 -o scan.pcd");
  app->callback([flags] { take_scan(*flags); });
}

}  // namespace pointflight::apps
