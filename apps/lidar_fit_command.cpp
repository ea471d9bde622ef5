#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/carried_lidar.hpp"
#include "apps/cli.hpp"
#include "apps/commands.hpp"
#include "apps/fitted_sigma.hpp"
#include "apps/flags.hpp"
#include "apps/settings_json.hpp"
#include "apps/surroundings_flags.hpp"
#include "apps/survey_flags.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/constants.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/number_text.hpp"
#include "pointflight/picture/sensor_picture.hpp"
#include "pointflight/survey/sensor_fit.hpp"

namespace pointflight::apps {
namespace {

namespace fs = std::filesystem;

constexpr double kRestless = 1.5;  // `SensorFit::unrest` from here on is said

struct SensorFitFlags : CarriedFlags {
  std::string input;
  std::string topic;
  std::int64_t scans = 100;
  std::optional<TimeUnit> time_unit;  ///< Nothing: recognised.
};

void print_fit_of(const SensorFit& fit) {
  fmt::print("{} scans, {} returns; noise on {} flat patches of {:g} degrees with {} of them\n",
             fit.scans,
             short_count(static_cast<double>(fit.points)),
             fit.patches,
             fit.patch_deg,
             short_count(static_cast<double>(fit.on_patches)));
  print_sigma("range noise", fit.noise.range, 1e3, "mm");
  print_sigma("direction noise", fit.noise.angle, 1.0 / kDegree, "deg about each of two axes");
  print_sigma(
      "at the limit", fit.noise.at_limit, 1e3, "mm more where signals are at their weakest");
  if (fit.turn) print_sigma("ring offsets", fit.ring_offset, 1e3, "mm from ring to ring");
  fmt::print("range step       {}\n",
             fit.range_step > 0.0 ? fmt::format("{:g} mm", 1e3 * fit.range_step) : "none");
  if (fit.rate) fmt::print("rate             {:.3f} scans per second\n", *fit.rate);
  if (fit.turn) {
    fmt::print("turns            {:.3f} per second, {}; {} rings, one firing every {:.3f} us\n",
               fit.turn->rate,
               fit.turn->is_clockwise ? "clockwise" : "counter-clockwise",
               fit.turn->rings.size(),
               fit.turn->cycle_us);
  }
  fmt::print("\n range (m)   incidence (deg)   noise (mm)   fitted (mm)   points\n");
  for (const NoiseBin& bin : fit.bins) {
    fmt::print(
        "{:>4g} to {:<4.0f}      {:>2.0f} to {:<2.0f}      {:>8.2f}      {:>8.2f}     {:>7}\n",
        bin.range_from,
        bin.range_to,
        bin.incidence_from / kDegree,
        bin.incidence_to / kDegree,
        1e3 * bin.sigma,
        1e3 * bin.fitted,
        short_count(static_cast<double>(bin.points)));
  }
  if (!fit.turn) return;
  fmt::print("\n ring   elevation (deg)   azimuth (deg)   fires at (us)   range offset (mm)\n");
  for (const RingFit& ring : fit.turn->rings) {
    fmt::print("{:>5}   {:>12.3f}   {:>13.3f}   {:>13.3f}   {:>16.1f}\n",
               ring.ring,
               ring.elevation_deg,
               ring.azimuth_offset_deg,
               ring.fire_time_us,
               1e3 * ring.range_offset);
  }
}

nlohmann::ordered_json json_of(const SensorFit& fit) {
  nlohmann::ordered_json json;
  json["scans"] = fit.scans;
  json["points"] = fit.points;
  json["patches"] = fit.patches;
  json["range_sigma"] = fit.noise.range.sigma;
  json["range_sigma_error"] = fit.noise.range.error;
  json["angle_sigma_deg"] = fit.noise.angle.sigma / kDegree;
  json["angle_sigma_error_deg"] = fit.noise.angle.error / kDegree;
  json["range_sigma_at_limit"] = fit.noise.at_limit.sigma;
  json["range_sigma_at_limit_error"] = fit.noise.at_limit.error;
  json["range_step"] = fit.range_step;
  json["range"] = {fit.range_min, fit.range_max};
  json["unrest"] = fit.unrest;
  if (fit.rate) json["rate"] = *fit.rate;
  for (const NoiseBin& bin : fit.bins) {
    json["noise"].push_back(
        {{"range", {bin.range_from, bin.range_to}},
         {"incidence_deg", {bin.incidence_from / kDegree, bin.incidence_to / kDegree}},
         {"sigma", bin.sigma},
         {"fitted", bin.fitted},
         {"patches", bin.patches},
         {"points", bin.points}});
  }
  if (!fit.turn) return json;
  json["turn"] = {{"rate", fit.turn->rate},
                  {"clockwise", fit.turn->is_clockwise},
                  {"cycle_us", fit.turn->cycle_us},
                  {"ring_offset_sigma", fit.ring_offset.sigma},
                  {"ring_offset_sigma_error", fit.ring_offset.error}};
  for (const RingFit& ring : fit.turn->rings) {
    json["turn"]["rings"].push_back({{"ring", ring.ring},
                                     {"elevation_deg", ring.elevation_deg},
                                     {"azimuth_offset_deg", ring.azimuth_offset_deg},
                                     {"fire_time_us", ring.fire_time_us},
                                     {"range_offset", ring.range_offset},
                                     {"points", ring.points}});
  }
  return json;
}

/// What a fit cannot say comes from --like; without it a turning sensor has what was measured.
LidarSettings settings_from(const SensorFitFlags& flags,
                            const SensorFit& fit,
                            const std::string& rings_table) {
  LidarSettings base;
  if (!flags.like.empty()) {
    base = load_lidar(flags.like);
    // tables under names that hold from anywhere
    static_cast<void>(tables_of(base));
  } else if (fit.turn) {
    base.range_min = std::floor(100.0 * fit.range_min) / 100.0;
    base.range_max = std::ceil(fit.range_max);
  } else {
    throw InputError(
        "-o: the scans do not say how the sensor looks around (no rings with times that turn "
        "evenly); give a sensor that is alike: --like mid360");
  }
  const bool has_rings = flags.like.empty() || base.pattern == ScanPattern::kRings;
  base = with_fit(base, fit, has_rings ? rings_table : "");
  base.title = flags.like.empty() ? "a spinning sensor, as measured" : base.title + ", as measured";
  base.source =
      fmt::format("{} returns of {} still scans in {}: noise, rate{}{}",
                  fit.points,
                  fit.scans,
                  fs::path(flags.input).filename().string(),
                  has_rings && fit.turn ? ", rings" : "",
                  flags.like.empty() ? "" : fmt::format("; the rest is {}'s", flags.like));
  return base;
}

void write_sensor(const SensorFitFlags& flags, const SensorFit& fit) {
  const fs::path path(flags.output);
  const std::string table = path.stem().string() + "_rings.csv";
  LidarSettings settings = settings_from(flags, fit, fit.turn ? table : "");
  const bool has_table = settings.rings.table == table;
  std::optional<OutputFile> rings;
  if (has_table) {
    const std::string rings_path = (path.parent_path() / table).string();
    check_outputs({rings_path}, {flags.input, flags.output, flags.png}, flags.force);
    rings.emplace(rings_path);
    rings->write(rings_csv(*fit.turn));
  }
  SettingsWriter writer;
  describe(writer, settings);
  OutputFile output(flags.output);
  output.write(writer.text());
  if (rings) rings->commit();
  output.commit();
  log(fmt::format("sensor: {}{}", flags.output, has_table ? " and " + table : ""));
}

void fit_lidar(const SensorFitFlags& flags) {
  if (!flags.map.empty()) {
    CarriedFlags carried = flags;
    carried.posed.files.scans = flags.input;
    carried.posed.files.time_unit = flags.time_unit;
    carried.posed.scan_topic = flags.topic;
    fit_carried_lidar(carried);
    return;
  }
  check_outputs({flags.output, flags.png}, {flags.input}, flags.force);
  if (!flags.output.empty() && !flags.output.ends_with(".yaml")) {
    throw InputError(fmt::format("-o {}: a sensor file ends in .yaml", flags.output));
  }
  const LidarSettings like = flags.like.empty() ? LidarSettings{} : load_lidar(flags.like);
  const Progress progress = interruptible_progress();
  const auto source = open_scans(flags.input, flags.topic, progress);
  std::vector<RecordedScan> scans =
      read_scans(*source, static_cast<std::size_t>(flags.scans), progress);
  end_progress();
  const std::string said = settle_times(scans, flags.time_unit, flags.input);
  if (!said.empty()) log(said);
  const SensorFit fit = [&] {
    try {
      return fit_sensor(
          scans, Executor(flags.threads), progress, like.detection, flags.surroundings.sun_klx);
    } catch (const InputError& error) {
      throw InputError(fmt::format("{}: {}", flags.input, error.what()));
    }
  }();
  end_progress();
  if (fit.unrest > kRestless) {
    log(
        fmt::format("what stands still moved {:.1f} times more from scan to scan than noise "
                    "explains: was the sensor at rest?",
                    fit.unrest));
  }
  if (fit.turn && !fit.turn->is_clockwise) {
    log("it turns counter-clockwise; sensor files know clockwise ones: rings will be mirrored in "
        "time");
  }
  OutputSet outputs;
  if (!flags.output.empty()) write_sensor(flags, fit);
  if (!flags.png.empty()) {
    picture::draw_sensor_fit(
        fit, "Noise of " + fs::path(flags.input).filename().string(), flags.png);
    log("picture: " + flags.png);
  }
  outputs.commit();
  if (flags.json) {
    print_json(json_of(fit));
  } else {
    print_fit_of(fit);
  }
}

}  // namespace

void add_lidar_fit_command(CLI::App& parent) {
  auto* app = parent.add_subcommand("fit",
                                    "Noise, rate and rings of your own sensor, from scans that it "
                                    "took standing still; with --map "
                                    "what is in its way, from scans with poses");
  auto flags = std::make_shared<SensorFitFlags>();
  app->add_option("input",
                  flags->input,
                  "Recording (.bag, .mcap, a folder of .mcap) or folder of clouds in the sensor "
                  "frame, of a place at rest with walls")
      ->required()
      ->check(CLI::ExistingPath);
  app->add_option("--scan-topic",
                  flags->topic,
                  "Topic of the clouds in a recording (PointCloud2, CustomMsg); needed only if "
                  "there are several");
  auto* map =
      app->add_option(
             "--map",
             flags->map,
             "Map (.pfmap) of what the scans saw: finds in which directions what carries the "
             "sensor blocks its beams (with --poses, --like)")
          ->check(CLI::ExistingFile);
  app->add_option("--poses", flags->posed.files.poses, "Poses of a folder's clouds: TUM or KITTI")
      ->check(CLI::ExistingFile)
      ->needs(map);
  app->add_option("--pose-topic", flags->posed.pose_topic, "Topic of the poses in a recording")
      ->needs(map);
  app->add_option("--sensor-pose",
                  flags->posed.sensor_pose,
                  "x,y,z,roll,pitch,yaw of the sensor in the frame that the poses are of (m, deg)")
      ->needs(map);
  app->add_flag("--deskewed",
                flags->posed.files.is_deskewed,
                "Ignore times of points: motion within the scans was compensated already")
      ->needs(map);
  for (CLI::Option* option : add_surroundings_flags(*app, flags->surroundings)) {
    if (!option->check_lname("sun")) option->needs(map);  // signals fade in it without a map, too
  }
  app->add_option("--scans", flags->scans, "Use at most this many scans, from the first")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str()
      ->excludes(map);
  add_time_unit_flag(*app, flags->time_unit);
  app->add_option("--like",
                  flags->like,
                  "Take what scans cannot tell (pattern, rated ranges, optics) from this sensor");
  app->add_option("-o,--output",
                  flags->output,
                  "Sensor file (.yaml) with the figures; a turning sensor gets a table of its "
                  "rings beside it, and with --map one of what is in the way");
  app->add_option("--png",
                  flags->png,
                  "Draw the noise over range and incidence, with --map what is in the way");
  app->add_flag("--json", flags->json, "JSON on stdout");
  add_force_flag(*app, flags->force);
  app->add_option("--threads", flags->threads, "0: all cores")->check(CLI::Range(0, 1024));
  app->footer(
      "Examples:\n  pointflight lidar fit still.mcap --like mid360 -o mine.yaml\n  pointflight "
      "lidar "
      "fit scans/ --map place.pfmap --poses poses.tum --like os0_64_2048 -o carried.yaml");
  app->callback([flags] { fit_lidar(*flags); });
}

}  // namespace pointflight::apps
