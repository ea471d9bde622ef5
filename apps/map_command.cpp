#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/cli.hpp"
#include "apps/commands.hpp"
#include "apps/flags.hpp"
#include "apps/import_report.hpp"
#include "apps/input_kind.hpp"
#include "apps/map_edit.hpp"
#include "apps/settings_json.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/number_text.hpp"
#include "pointflight/geometry/shape_scene.hpp"
#include "pointflight/io/pcd_writer.hpp"
#include "pointflight/map/fitted_scans.hpp"
#include "pointflight/map/import/map_builder.hpp"
#include "pointflight/picture/pictures.hpp"

namespace pointflight::apps {
namespace {

struct InfoFlags {
  std::string map;
  std::string png;
  std::vector<std::string> points;  ///< --at
  bool json = false;
  bool verify = false;
  bool force = false;
};

nlohmann::ordered_json metadata_of(const SurfelMap& map) {
  auto parsed = nlohmann::ordered_json::parse(map.metadata(), nullptr, false);
  return parsed.is_object() ? parsed : nlohmann::ordered_json::object();
}

/// A number of the metadata, 0 if there is none: the file may hold anything.
double number_in(const nlohmann::ordered_json& json, const char* key) {
  if (!json.is_object() || !json.contains(key) || !json[key].is_number()) return 0.0;
  return json[key].get<double>();
}

std::uint64_t count_in(const nlohmann::ordered_json& json, const char* key) {
  return static_cast<std::uint64_t>(std::clamp(number_in(json, key), 0.0, 1e18));
}

/// What the import found in the points, where the file says it.
void print_findings(const nlohmann::ordered_json& metadata, double resolution) {
  if (!metadata.contains("noise")) return;
  const auto projection = metadata.value("projection", nlohmann::ordered_json::object());
  // what was tried needs no advice
  const bool was_tried = metadata.value("resolution_was_tried", nlohmann::ordered_json()) == true;
  fmt::print("  spacing     {}\n",
             about_spacing(number_in(metadata, "point_spacing"),
                           resolution,
                           was_tried ? 0.0 : number_in(metadata, "supported_resolution")));
  fmt::print("  noise       {}\n",
             about_noise(number_in(metadata, "noise"),
                         count_in(projection, "projected"),
                         count_in(projection, "too_thick")));
  const std::uint64_t grown = count_in(metadata, "grown_surfels");
  const std::uint64_t wide = count_in(metadata, "wide_surfels");
  if (grown + wide > 0) {
    fmt::print(
        "  thin scan   {} surfels widened to close gaps, {} for several cells each\n", grown, wide);
  }
  const std::uint64_t merged = count_in(metadata, "merged_surfels");
  if (merged > 0) fmt::print("  planes      {} surfels for several cells each\n", merged);
  const std::uint64_t small = count_in(metadata, "small_surfels");
  if (small > 0) fmt::print("  fine forms  {} surfels for parts of cells\n", small);
}

constexpr double kNearestReach = 1e3;  // m

/// What is at a point: JSON for one, a line for the other.
struct PlaceInfo {
  Vector3d point_world;
  std::optional<Nearest> nearest;
  std::optional<bool> known;  ///< Nothing if the map does not say.
};

std::vector<PlaceInfo> places_at(const SurfelMap& map, const std::vector<std::string>& points) {
  std::vector<PlaceInfo> places;
  for (const std::string& text : points) {
    const Vector3d point(parse_numbers(text, 3, "--at", "x,y,z in metres").data());
    PlaceInfo place{point, map.nearest(point, kNearestReach), std::nullopt};
    if (map.known_space() != nullptr) place.known = map.known_space()->known(point);
    places.push_back(place);
  }
  return places;
}

nlohmann::ordered_json json_of(const std::vector<PlaceInfo>& places) {
  auto list = nlohmann::ordered_json::array();
  for (const PlaceInfo& place : places) {
    nlohmann::ordered_json json;
    json["point"] = {place.point_world.x(), place.point_world.y(), place.point_world.z()};
    json["nearest"] = place.nearest ? nlohmann::ordered_json(place.nearest->distance) : nullptr;
    json["known"] = place.known ? nlohmann::ordered_json(*place.known) : nullptr;
    list.push_back(json);
  }
  return list;
}

void print_places(const std::vector<PlaceInfo>& places) {
  for (const PlaceInfo& place : places) {
    fmt::print("  at {}  {}, {}\n",
               point_text(place.point_world),
               place.nearest
                   ? fmt::format("{:.2f} m to the nearest surfel", place.nearest->distance)
                   : fmt::format("nothing within {:.0f} m", kNearestReach),
               !place.known   ? "the map does not say whether it was seen"
               : *place.known ? "seen by the survey"
                              : "not seen by the survey");
  }
}

/// What a map's surfels are like.
struct SurfelCount {
  std::uint64_t surfels = 0;
  std::uint64_t planar = 0;
  std::uint64_t assumed = 0;
  std::uint64_t clear = 0;  ///< Let beams through.
  std::uint64_t labelled = 0;

  explicit SurfelCount(const SurfelMap& map) {
    map.for_each_surfel([&](const Vector3d&, const Vector3d&, double, std::uint32_t word) {
      ++surfels;
      planar += is_planar(map.words()[word]) ? 1 : 0;
      const SurfelNote note = map.notes().of(word);
      assumed += note.is_assumed ? 1 : 0;
      clear += note.opacity != Opacity::kOpaque ? 1 : 0;
      labelled += note.label.kind != 0 ? 1 : 0;
    });
  }
  [[nodiscard]] double planar_share() const {
    return surfels == 0 ? 0.0 : static_cast<double>(planar) / static_cast<double>(surfels);
  }
  [[nodiscard]] double bytes_each(const SurfelMap& map) const {
    return surfels == 0 ? 0.0 : static_cast<double>(map.file_size()) / static_cast<double>(surfels);
  }
};

nlohmann::ordered_json info_json(const SurfelMap& map,
                                 const SurfelCount& count,
                                 const InfoFlags& flags) {
  const Aabb& b = map.bounds_world();
  nlohmann::ordered_json json;
  json["file"] = flags.map;
  json["surfels"] = count.surfels;
  json["resolution"] = map.resolution();
  json["min"] = {b.min.x(), b.min.y(), b.min.z()};
  json["max"] = {b.max.x(), b.max.y(), b.max.z()};
  json["planar_share"] = count.planar_share();
  json["assumed"] = count.assumed;
  json["labelled"] = count.labelled;
  json["letting_through"] = count.clear;
  json["fitted_scans"] = fitted_scans(map).size();
  json["bytes"] = map.file_size();
  json["bytes_per_surfel"] = count.bytes_each(map);
  json["has_intensity"] = map.has_intensity();
  if (map.reflectivity_per_intensity() > 0.0) {
    json["reflectivity_per_intensity"] = map.reflectivity_per_intensity();
  }
  if (const KnownSpace* known = map.known_space()) {
    json["known_space"]["share"] = known->known_share();
    json["known_space"]["cell"] = known->grid().cell;
  }
  if (const auto places = places_at(map, flags.points); !places.empty()) {
    json["at"] = json_of(places);
  }
  json["verified"] = flags.verify;
  json["made"] = metadata_of(map);
  return json;
}

void print_info(const SurfelMap& map, const SurfelCount& count, const InfoFlags& flags) {
  const KnownSpace* known = map.known_space();
  const Aabb& b = map.bounds_world();
  const auto metadata = metadata_of(map);
  fmt::print("{}\n", flags.map);
  fmt::print("  surfels     {}, {:.0f} % planar\n", count.surfels, 100.0 * count.planar_share());
  fmt::print("  resolution  {:.4g} m\n", map.resolution());
  fmt::print("  extent      {:.2f} x {:.2f} x {:.2f} m, from {}\n",
             b.size().x(),
             b.size().y(),
             b.size().z(),
             point_text(b.min));
  fmt::print("  size        {:.1f} MB, {:.1f} bytes per surfel\n",
             static_cast<double>(map.file_size()) * 1e-6,
             count.bytes_each(map));
  print_findings(metadata, map.resolution());
  fmt::print("  threshold   {:.2f} of a beam covered makes a return\n", map.model().tau);
  fmt::print("  intensity   {}{}\n",
             map.has_intensity() ? "yes" : "no",
             map.reflectivity_per_intensity() > 0.0
                 ? fmt::format(", reflectivity is {:.4g} of it", map.reflectivity_per_intensity())
                 : "");
  if (count.labelled > 0) {
    fmt::print("  labels      {:.1f} % of the surfels, {} classes\n",
               100.0 * static_cast<double>(count.labelled) / static_cast<double>(count.surfels),
               map.notes().class_names().size() - 1);
  }
  if (count.clear > 0) fmt::print("  opacity     {} surfels let beams through\n", count.clear);
  if (known != nullptr) {
    fmt::print(
        "  seen space  {:.0f} % of the box of map and survey, {:.0f} % unknown (cells of {:.2g} "
        "m)\n",
        100.0 * known->known_share(),
        100.0 * (1.0 - known->known_share()),
        known->grid().cell);
  }
  if (const std::size_t fitted = fitted_scans(map).size(); fitted > 0) {
    fmt::print("  fitted      to the rays of {} scans\n", fitted);
  }
  if (count.assumed > 0) {
    fmt::print(
        "  assumed     {} surfels close holes in floors and walls that no ray went through\n",
        count.assumed);
  }
  print_places(places_at(map, flags.points));
  if (flags.verify) fmt::print("  checksums   match\n");
  fmt::print("  made\n");
  for (const auto& [key, value] : metadata.items())
    fmt::print("    {} {}\n",
               printable(key),
               value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

void show_info(const InfoFlags& flags) {
  check_outputs({flags.png}, {flags.map}, flags.force);
  require_kind(flags.map, {InputKind::kMap}, "a map (.pfmap)");
  const auto map = SurfelMap::open(flags.map);
  if (flags.verify) map->verify();
  if (flags.json) {
    print_json(info_json(*map, SurfelCount(*map), flags));
  } else {
    print_info(*map, SurfelCount(*map), flags);
  }
  if (!flags.png.empty()) {
    picture::draw_map(*map, flags.map, flags.png);
    log("picture: " + flags.png);
  }
}

void add_info(CLI::App& parent) {
  auto* app = parent.add_subcommand("info", "Say what is in a .pfmap and how it was made");
  auto flags = std::make_shared<InfoFlags>();
  app->add_option("map", flags->map, "A .pfmap")->required();
  app->add_flag("--json", flags->json, "JSON on stdout");
  app->add_option("--png", flags->png, "Draw a top and a side view");
  app->add_option(
         "--at",
         flags->points,
         "x,y,z in the world, m: how far the nearest surfel is, and whether the survey saw "
         "that place; as often as wanted")
      ->allow_extra_args(false);
  app->add_flag("--verify", flags->verify, "Read all of it and check checksums and structure");
  add_force_flag(*app, flags->force);
  app->callback([flags] { show_info(*flags); });
}

struct ForestFlags {
  std::string output;
  ForestOptions options;
  double density = 800.0;
  double noise = 0.005;
  bool force = false;
};

void make_forest_cloud(const ForestFlags& flags) {
  check_outputs({flags.output}, {}, flags.force);
  const ShapeScene scene = make_forest(flags.options);
  std::vector<CloudPoint> points;
  scene.sample(flags.density, flags.noise, flags.options.seed, [&](const Vector3d& p) {
    points.push_back({p, 0.0f});
  });
  write_cloud_pcd(OutputFile(flags.output), points, false);
  log(fmt::format("{} points on {} shapes",
                  short_count(static_cast<double>(points.size())),
                  short_count(static_cast<double>(scene.shapes.size()))));
  fmt::print("{}\n", flags.output);
}

void add_forest(CLI::App& parent) {
  auto* app = parent.add_subcommand("forest", "Make up a forest as a PCD cloud, to try things on");
  auto flags = std::make_shared<ForestFlags>();
  ForestOptions& o = flags->options;
  app->add_option("-o,--output", flags->output, "The .pcd to write")->required();
  app->add_option("--size-x", o.size_x, "m")->check(within(5.0, 1000.0))->capture_default_str();
  app->add_option("--size-y", o.size_y, "m")->check(within(5.0, 1000.0))->capture_default_str();
  app->add_option("--trees", o.trees_per_hectare, "Trees a hectare")
      ->check(within(0.0, 10000.0))
      ->capture_default_str();
  app->add_option("--spacing", o.min_spacing, "Least distance between trunks, m")
      ->check(within(0.0, 100.0))
      ->capture_default_str();
  app->add_option("--density", flags->density, "Points a square metre of surface")
      ->check(within(1.0, 1e6))
      ->capture_default_str();
  app->add_option("--noise", flags->noise, "Deviation of the points from the surface, m")
      ->check(within(0.0, 1.0))
      ->capture_default_str();
  app->add_option("--seed", o.seed, "Another seed, another forest")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  add_force_flag(*app, flags->force);
  app->callback([flags] { make_forest_cloud(*flags); });
}

}  // namespace

void add_map_command(CLI::App& parent, int& /*exit_code*/) {
  auto* app = parent.add_subcommand("map", "Make, look at and edit maps");
  app->require_subcommand(1);
  add_import(*app);
  add_info(*app);
  add_fit(*app);
  add_crop(*app);
  add_thin(*app);
  add_transform(*app);
  add_merge(*app);
  add_export(*app);
  add_diff(*app);
  add_forest(*app);
}

}  // namespace pointflight::apps
