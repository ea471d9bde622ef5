#include "apps/carried_lidar.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "apps/cli.hpp"
#include "apps/fitted_sigma.hpp"
#include "apps/flags.hpp"
#include "apps/input_kind.hpp"
#include "apps/settings_json.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/fidelity/blockage_fit.hpp"
#include "pointflight/fidelity/deskewing_fit.hpp"
#include "pointflight/map/surfel_map.hpp"
#include "pointflight/picture/sensor_picture.hpp"

namespace pointflight::apps {
namespace {

namespace fs = std::filesystem;

double rounded(double value, double decimals) {
  return std::round(value * decimals) / decimals;
}

/// The sensor as it is carried: its file, and a table beside it.
void write_carried_sensor(const CarriedFlags& flags,
                          const BlockageFit& fit,
                          const DeskewingFit& deskewing) {
  const fs::path path(flags.output);
  const std::string table = path.stem().string() + "_blocked.csv";
  const std::string table_path = (path.parent_path() / table).string();
  check_outputs({table_path}, {flags.output, flags.png, flags.map}, flags.force);
  LidarSettings settings = load_lidar(flags.like);
  // tables under names that hold from anywhere
  static_cast<void>(tables_of(settings));
  settings.title += ", as carried";
  settings.source = fmt::format(
      "what is in its way, what deskewing left: {} scans in {} beside {}; the rest is {}'s",
      fit.scans,
      fs::path(flags.posed.files.scans).filename().string(),
      fs::path(flags.map).filename().string(),
      flags.like);
  settings.blocked = table;
  if (deskewing.rotation.shows()) {
    settings.deskewing.rotation_sigma_deg = rounded(deskewing.rotation.sigma / kDegree, 1e3);
  }
  if (deskewing.translation.shows()) {
    settings.deskewing.translation_sigma = rounded(deskewing.translation.sigma, 1e4);
  }
  OutputFile sectors(table_path);
  sectors.write(blocked_sectors_csv(fit.sectors));
  SettingsWriter writer;
  describe(writer, settings);
  OutputFile output(flags.output);
  output.write(writer.text());
  sectors.commit();
  output.commit();
  log(fmt::format("sensor: {} and {}", flags.output, table));
}

nlohmann::ordered_json json_of(const BlockageFit& fit, const DeskewingFit& deskewing) {
  nlohmann::ordered_json json = {{"scans", fit.scans},
                                 {"told", fit.told},
                                 {"blocked", fit.blocked},
                                 {"returns", fit.returns},
                                 {"modelled", fit.modelled},
                                 {"explained", fit.explained},
                                 {"sectors", nlohmann::ordered_json::array()}};
  for (const BlockedSector& s : fit.sectors) {
    json["sectors"].push_back({{"azimuth_deg", {s.azimuth_from, s.azimuth_to}},
                               {"elevation_deg", {s.elevation_from, s.elevation_to}},
                               {"share", s.share}});
  }
  if (!deskewing.motions.empty()) {
    json["deskewing"] = {{"scans", deskewing.motions.size()},
                         {"rotation_sigma_deg", deskewing.rotation.sigma / kDegree},
                         {"rotation_sigma_error_deg", deskewing.rotation.error / kDegree},
                         {"translation_sigma", deskewing.translation.sigma},
                         {"translation_sigma_error", deskewing.translation.error}};
  }
  return json;
}

void print_fit_of(const BlockageFit& fit, const DeskewingFit& deskewing) {
  fmt::print("{} scans; the map tells it for {:.0f} % of the beams\n", fit.scans, 100.0 * fit.told);
  fmt::print("in the way       {:.1f} % of all beams are lost to it\n", 100.0 * fit.blocked);
  fmt::print(
      "beams that return {:.1f} %; by the model {:.1f} %, with what is in the way {:.1f} %\n",
      100.0 * fit.returns,
      100.0 * fit.modelled,
      100.0 * fit.explained);
  if (deskewing.motions.empty()) {
    fmt::print("left by deskewing: the scans do not tell it\n");
    return;
  }
  fmt::print("left by deskewing, from a scan's first beam to its last:\n");
  print_sigma("rotation", deskewing.rotation, 1.0 / kDegree, "deg about each axis");
  print_sigma("translation", deskewing.translation, 1e3, "mm along each axis");
}

}  // namespace

void fit_carried_lidar(const CarriedFlags& flags) {
  if (flags.like.empty()) {
    throw InputError("--map: which sensor took the scans? Name it: --like os0_64_2048");
  }
  check_outputs({flags.output, flags.png}, {flags.posed.files.scans, flags.map}, flags.force);
  require_kind(flags.map, {InputKind::kMap}, "a map (.pfmap)");
  const LidarSettings lidar = load_lidar(flags.like);
  const auto map = SurfelMap::open(flags.map);
  const Progress progress = interruptible_progress();
  const auto scans = read_real_scans(*open_survey(flags.posed, progress), progress);
  end_progress();
  const auto renderer = make_renderer("beam", Scene{map});
  const Executor executor(flags.threads);
  const BlockageFit fit = fit_blockage(
      scans, lidar, surroundings_in(*map, flags.surroundings), *renderer, executor, progress);
  const DeskewingFit deskewing = fit_deskewing(scans, lidar, *map, *renderer, executor, progress);
  end_progress();
  OutputSet outputs;
  if (!flags.output.empty()) write_carried_sensor(flags, fit, deskewing);
  if (!flags.png.empty()) {
    picture::draw_blockage(fit, "In the way of " + flags.like, flags.png);
    log("picture: " + flags.png);
  }
  outputs.commit();
  if (flags.json) {
    print_json(json_of(fit, deskewing));
  } else {
    print_fit_of(fit, deskewing);
  }
}

}  // namespace pointflight::apps
