#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

#include "apps/commands.hpp"
#include "pointflight/core/constants.hpp"
#include "pointflight/core/number_text.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/lidar/lidar.hpp"

namespace pointflight::apps {
namespace {

void list_lidars() {
  for (const std::string& name : model_names("lidars")) {
    const LidarSettings s = load_lidar(name);
    fmt::print("{:<12}  {:<9} {:>5.1f} Hz  {:>5.1f} m  {}\n",
               name,
               s.pattern,
               s.rate,
               s.range_max,
               s.title);
  }
}

void show_lidar(const std::string& name) {
  LidarSettings s = load_lidar(name);
  const Executor executor;
  const Lidar lidar(s, 0);
  const std::vector<Beam> beams = lidar.beams(0, executor);
  double el_low = kPi;
  double el_high = -kPi;
  double az_low = kPi;
  double az_high = -kPi;
  std::set<std::uint16_t> rings;
  Duration last{0};
  for (const Beam& beam : beams) {
    const Vector3d d = beam.direction_sensor.cast<double>();
    const double az = std::atan2(d.y(), d.x());
    const double el = std::asin(std::clamp(d.z(), -1.0, 1.0));
    az_low = std::min(az_low, az);
    az_high = std::max(az_high, az);
    el_low = std::min(el_low, el);
    el_high = std::max(el_high, el);
    rings.insert(beam.ring);
    last = std::max(last, beam.time_offset);
  }
  fmt::print(
      "# {}\n# first scan: {} beams over {:.2f} ms, {} rings or lines; azimuth {} to {} deg, "
      "elevation {} to {} deg\n",
      s.path,
      beams.size(),
      to_seconds(last) * 1e3,
      rings.size(),
      fixed_text(az_low / kDegree, 2),
      fixed_text(az_high / kDegree, 2),
      fixed_text(el_low / kDegree, 2),
      fixed_text(el_high / kDegree, 2));
  SettingsWriter writer;
  describe(writer, s);
  fmt::print("{}", writer.text());
}

}  // namespace

void add_lidar_command(CLI::App& parent, int& /*exit_code*/) {
  auto* app = parent.add_subcommand("lidar", "Sensors: a YAML file each");
  app->require_subcommand(1);
  auto* list = app->add_subcommand("list", "Names of the shipped sensors");
  list->callback([] { list_lidars(); });
  auto* show = app->add_subcommand("show", "What a sensor's file says, and its first scan");
  auto name = std::make_shared<std::string>();
  show->add_option("name", *name, "A shipped sensor or the path of a .yaml file")->required();
  show->callback([name] { show_lidar(*name); });
}

}  // namespace pointflight::apps
