#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "apps/cli.hpp"
#include "apps/commands.hpp"
#include "apps/flags.hpp"
#include "apps/settings_json.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/number_text.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/lidar/lidar_cost.hpp"
#include "pointflight/picture/pictures.hpp"
#include "pointflight/picture/scan_statistics.hpp"

namespace pointflight::apps {
namespace {

struct LidarFlags {
  std::string name;
  std::string picture;
  bool json = false;
  bool path = false;  ///< Nothing but where the file lies.
  bool force = false;
};

/// Under the names of their keys.
std::vector<std::pair<std::string, Ground>> named(const GroundsSettings& grounds) {
  return {{"pattern", grounds.pattern},
          {"ranges", grounds.ranges},
          {"range_noise", grounds.range_noise},
          {"direction_noise", grounds.direction_noise},
          {"beam_width", grounds.beam_width}};
}

nlohmann::ordered_json json_of(const GroundsSettings& grounds) {
  nlohmann::ordered_json json;
  for (const auto& [name, ground] : named(grounds)) json[name] = to_string(ground);
  return json;
}

void list_lidars(const LidarFlags& flags) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  const std::vector<std::string> names = model_names("lidars");
  if (!flags.json) {
    fmt::print("{:<15} {:<8} {:>7} {:>7}   {:<8}  {:<8}  {:<8}  {:<9}  {:<8}  {}\n",
               "name",
               "kind",
               "Hz",
               "m",
               "pattern",
               "ranges",
               "noise",
               "direction",
               "width",
               "what its figures rest on (columns 5 to 9), and what it is");
  }
  for (const std::string& name : names) {
    const LidarSettings s = load_lidar(name);
    if (flags.json) {
      json.push_back({{"name", name},
                      {"title", s.title},
                      {"pattern", to_string(s.pattern)},
                      {"rate", s.rate},
                      {"range_max", s.range_max},
                      {"grounds", json_of(s.grounds)},
                      {"path", s.path}});
      continue;
    }
    fmt::print("{:<15} {:<8} {:>7.1f} {:>7.1f}   {:<8}  {:<8}  {:<8}  {:<9}  {:<8}  {}\n",
               name,
               to_string(s.pattern),
               s.rate,
               s.range_max,
               to_string(s.grounds.pattern),
               to_string(s.grounds.ranges),
               to_string(s.grounds.range_noise),
               to_string(s.grounds.direction_noise),
               to_string(s.grounds.beam_width),
               s.title);
  }
  if (flags.json) print_json(json);
}

nlohmann::ordered_json json_of(const picture::ScanStatistics& scan) {
  nlohmann::ordered_json json;
  json["beams"] = scan.beams;
  json["beams_per_second"] = scan.beams_a_second;
  json["time_span"] = scan.span;
  json["rings"] = scan.rings;
  json["azimuth_deg"] = {scan.azimuth_min, scan.azimuth_max};
  json["elevation_deg"] = {scan.elevation_min, scan.elevation_max};
  json["spacing_along_ring_deg"] = scan.along_ring;
  json["spacing_nearest_deg"] = scan.nearest;
  if (scan.blocked > 0.0) json["blocked"] = scan.blocked;
  if (scan.between_rings) {
    json["spacing_between_rings_deg"] = {scan.between_rings->first, scan.between_rings->second};
  }
  return json;
}

void print_statistics(const LidarSettings& s, const picture::ScanStatistics& scan) {
  const char* lines = s.pattern == ScanPattern::kRings  ? "rings"
                      : s.pattern == ScanPattern::kGrid ? "rows"
                                                        : "lines";
  fmt::print(
      "# scan: {} beams, {} {}, fired within {} ms; {:g} scans and {:.0f} beams per second\n",
      scan.beams,
      scan.rings,
      lines,
      fixed_text(scan.span * 1e3, 2),
      s.rate,
      scan.beams_a_second);
  fmt::print("# field of view: azimuth {} to {} deg, elevation {} to {} deg\n",
             fixed_text(scan.azimuth_min, 2),
             fixed_text(scan.azimuth_max, 2),
             fixed_text(scan.elevation_min, 2),
             fixed_text(scan.elevation_max, 2));
  fmt::print("# spacing: {} deg from beam to beam of a {}{}; nearest neighbour {} deg (medians)\n",
             fixed_text(scan.along_ring, 3),
             std::string(lines).substr(0, std::string(lines).size() - 1),
             scan.between_rings ? fmt::format(", {} to {} deg between rings",
                                              fixed_text(scan.between_rings->first, 3),
                                              fixed_text(scan.between_rings->second, 3))
                                : std::string(),
             fixed_text(scan.nearest, 3));
  if (scan.blocked > 0.0) {
    fmt::print("# in the way: what carries it takes {:.1f} % of the beams, on average\n",
               100.0 * scan.blocked);
  }
}

/// What its figures rest on, what is surest first.
void print_grounds(const GroundsSettings& grounds) {
  std::string said;
  for (const Ground ground :
       {Ground::kMeasured, Ground::kSheet, Ground::kQuoted, Ground::kAssumed}) {
    std::string names;
    for (const auto& [name, its] : named(grounds)) {
      if (its == ground) names += (names.empty() ? "" : ", ") + name;
    }
    if (names.empty()) continue;
    said += fmt::format("{}{}: {}", said.empty() ? "" : "; ", to_string(ground), names);
  }
  fmt::print("# figures: {}\n", said);
}

void print_cost(const LidarCostClass& cost) {
  if (!cost.wide) {
    fmt::print("# cost: {}, about {} of a core\n", cost.name, fixed_text(cost.line, 2));
    return;
  }
  fmt::print(
      "# cost: {}, about {} (in a hall) to {} (in a forest) of a core; {} with beams as lines\n",
      cost.name,
      fixed_text(cost.low, 2),
      fixed_text(cost.high, 2),
      fixed_text(cost.line, 2));
}

nlohmann::ordered_json json_of(const LidarCostClass& cost) {
  nlohmann::ordered_json json;
  json["class"] = cost.name;
  json["cores"] = {cost.low, cost.high};
  json["cores_as_lines"] = cost.line;
  return json;
}

void show_lidar(const LidarFlags& flags) {
  LidarSettings s = load_lidar(flags.name);
  check_outputs({flags.picture}, {s.path}, flags.force);
  const picture::ScanStatistics scan = picture::scan_statistics(s);
  if (flags.path) {
    fmt::print("{}\n", s.path);
    return;
  }
  const LidarCostClass cost = cost_class_of(s, scan.beams_a_second);
  if (flags.json) {
    nlohmann::ordered_json json;
    json["path"] = s.path;
    json["scan"] = json_of(scan);
    json["cost"] = json_of(cost);
    json["settings"] = json_of_settings(s);
    print_json(json);
  } else {
    fmt::print("# {}\n", s.path);
    print_statistics(s, scan);
    print_cost(cost);
    print_grounds(s.grounds);
    SettingsWriter writer;
    describe(writer, s);
    fmt::print("{}", writer.text());
  }
  if (flags.picture.empty()) return;
  picture::draw_lidar(s, flags.picture);
  log("picture: " + flags.picture);
}

}  // namespace

void add_lidar_command(CLI::App& parent, int& /*exit_code*/) {
  auto* app = parent.add_subcommand("lidar", "Sensors: a YAML file each");
  app->require_subcommand(1);
  app->alias("sensor");
  auto flags = std::make_shared<LidarFlags>();
  auto* list = app->add_subcommand("list", "Names of the shipped sensors");
  list->add_flag("--json", flags->json, "JSON on stdout");
  list->callback([flags] { list_lidars(*flags); });
  auto* show =
      app->add_subcommand("show", "What a sensor's file says, and figures of its first scan");
  show->add_option(
          "name",
          flags->name,
          "A shipped sensor, a .yaml file, Ouster's metadata (.json) or a Livox table (.csv)")
      ->required();
  show->add_option(
      "--png", flags->picture, "Draw its pattern after 0.1 s and 1 s, and its coverage over time");
  add_force_flag(*show, flags->force);
  show->add_flag("--json", flags->json, "JSON on stdout");
  show->add_flag("--path", flags->path, "Say where its file lies, to copy it");
  show->callback([flags] { show_lidar(*flags); });
  add_lidar_fit_command(*app);
  auto* keys = app->add_subcommand(
      "keys", "All keys of a sensor file as a Markdown table (docs/sensors.md)");
  keys->callback([] { print_reference(lidar_reference()); });
}

}  // namespace pointflight::apps
