#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "apps/cli.hpp"
#include "apps/flags.hpp"
#include "apps/map_edit.hpp"
#include "apps/settings_json.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/number_text.hpp"

namespace pointflight::apps {
namespace {

// ---- export ----

struct ExportFlags : EditFlags {
  std::string what;
  double density = 0.0;
};

CloudColumns columns_of_map(const ExportFlags& flags, const SurfelMap& map) {
  const bool las = flags.output.ends_with(".las");
  const std::string what = flags.what.empty() ? (las ? "points" : "normals") : flags.what;
  CloudColumns columns;
  columns.intensity = map.has_intensity();
  columns.normal = what != "points";
  columns.ellipsoid = what == "surfels";
  if (columns.ellipsoid && flags.density > 0.0) {
    throw InputError("--what surfels is one row per surfel; leave --density out");
  }
  return columns;
}

/// Drops what is not finite from a batch and its raw columns. Returns how many that were.
std::uint64_t drop_not_finite(std::vector<CloudPoint>& points, std::vector<std::byte>& raw) {
  const std::size_t size = points.empty() ? 0 : raw.size() / points.size();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].position.allFinite()) continue;
    points[kept] = points[i];
    std::copy_n(raw.data() + i * size, size, raw.data() + kept * size);
    ++kept;
  }
  const std::uint64_t dropped = points.size() - kept;
  points.resize(kept);
  raw.resize(kept * size);
  return dropped;
}

/// Cloud to cloud: with all columns that the format holds; an organised one stays organised.
void export_cloud(const ExportFlags& flags, const Progress& progress) {
  if (!flags.what.empty() || flags.density > 0.0) {
    throw InputError(
        fmt::format("{}: is a cloud; --what and --density are for maps", flags.inputs.front()));
  }
  const CloudSource source =
      cloud_sources(flags.inputs, flags.format, scratch_of(flags), progress).front();
  const auto reader = source.open({}, progress);
  reader->keep_raw();
  CloudColumns columns = columns_of(*reader);
  columns.raw = reader->raw_columns();
  if (flags.output.ends_with(".pcd")) columns.shape = reader->shape();
  CloudOutput output(flags, columns);
  std::uint64_t read = 0;
  std::uint64_t not_finite = 0;
  std::vector<CloudPoint> points;
  while (reader->read(points)) {
    read += points.size();
    std::vector<std::byte> raw(reader->raw().begin(), reader->raw().end());
    if (!columns.shape) not_finite += drop_not_finite(points, raw);
    output.write(points, raw);
    report(progress, "exporting", reader->share_read());
  }
  output.finish(read, not_finite, "exported");
  if (columns.shape)
    log(fmt::format("organised     {} x {}", columns.shape->width, columns.shape->height));
}

void export_map(const ExportFlags& flags) {
  require_writable_cloud(flags.output);
  check_outputs({flags.output, flags.png}, flags.inputs, flags.force);
  const Progress progress = interruptible_progress();
  if (!is_map(flags.inputs.front())) {
    export_cloud(flags, progress);
    return;
  }
  const auto map = open_sound_map(flags.inputs.front());
  CloudOutput output(flags, columns_of_map(flags, *map));
  std::uint64_t rows_written = 0;
  for_each_row(*map, flags.density, [&](std::span<const CloudRow> rows) {
    output.write(rows);
    rows_written += rows.size();
    report(progress, "exporting", 0.0);
  });
  output.finish(rows_written, 0, "exported");
}

// ---- diff ----

struct DiffFlags : EditFlags {
  double distance = 0.0;
  double resolution = 0.0;
  bool json = false;
};

/// A map, or what a cloud becomes at `resolution` (0: the one that its spacing supports).
std::shared_ptr<const SurfelMap> as_map(const DiffFlags& flags,
                                        const std::string& input,
                                        const Executor& executor,
                                        const Progress& progress) {
  if (is_map(input)) return SurfelMap::open(input);
  ImportOptions options;
  if (flags.resolution > 0.0) options.resolution = flags.resolution;
  options.outliers.enabled = false;  // differences may be small and alone
  options.quality = TreeQuality::kNormal;
  options.scratch_folder = scratch_of(flags);
  const ImportedMap imported =
      import_clouds(cloud_sources({input}, flags.format, options.scratch_folder, progress),
                    options,
                    executor,
                    progress);
  return SurfelMap::from_bytes(map_bytes(imported.tree, imported.description), input);
}

/// What one has and the other has not.
struct OneWay {
  std::string name;
  std::uint64_t missing = 0;
  std::uint64_t surfels = 0;
  Aabb where;
  picture::PointSample sample;
  [[nodiscard]] double share() const {
    return surfels == 0 ? 0.0 : static_cast<double>(missing) / static_cast<double>(surfels);
  }
};

constexpr picture::Color kOnlyFirst{0.82, 0.12, 0.12};
constexpr picture::Color kOnlySecond{0.1, 0.35, 0.85};

std::array<std::uint8_t, 3> bytes_of(const picture::Color& color) {
  const auto part = [](double share) {
    return static_cast<std::uint8_t>(std::lround(255.0 * share));
  };
  return {part(color.r), part(color.g), part(color.b)};
}

void print_diff(const std::vector<OneWay>& ways, double distance) {
  for (const OneWay& way : ways) {
    fmt::print("only in {}: {} of {} surfels, {:.2f} %, {}\n",
               way.name,
               way.missing,
               way.surfels,
               100.0 * way.share(),
               way.missing == 0
                   ? fmt::format("none farther than {:.3g} m from the other", distance)
                   : fmt::format("farther than {:.3g} m from the other, between {} and {}",
                                 distance,
                                 point_text(way.where.min),
                                 point_text(way.where.max)));
  }
}

nlohmann::ordered_json json_of(const std::vector<OneWay>& ways, double distance) {
  nlohmann::ordered_json json;
  json["distance"] = distance;
  for (std::size_t i = 0; i < ways.size(); ++i) {
    auto& way = json[i == 0 ? "only_in_first" : "only_in_second"];
    way["file"] = ways[i].name;
    way["surfels"] = ways[i].surfels;
    way["missing"] = ways[i].missing;
    way["share"] = ways[i].share();
    if (ways[i].missing == 0) continue;
    const Aabb& b = ways[i].where;
    way["min"] = {b.min.x(), b.min.y(), b.min.z()};
    way["max"] = {b.max.x(), b.max.y(), b.max.z()};
  }
  return json;
}

void draw_diff(const DiffFlags& flags,
               const std::vector<OneWay>& ways,
               double distance,
               const picture::PointSample& all) {
  picture::draw_points(fmt::format("{} and {}", flags.inputs[0], flags.inputs[1]),
                       fmt::format("what lies farther than {:.3g} m from the other", distance),
                       {{"the first", {0.75, 0.75, 0.75}, false, &all},
                        {fmt::format("only in the first: {:.2f} %", 100.0 * ways[0].share()),
                         kOnlyFirst,
                         false,
                         &ways[0].sample},
                        {fmt::format("only in the second: {:.2f} %", 100.0 * ways[1].share()),
                         kOnlySecond,
                         false,
                         &ways[1].sample}},
                       flags.png);
  log("picture: " + flags.png);
}

void diff(const DiffFlags& flags) {
  check_outputs({flags.output, flags.png}, flags.inputs, flags.force);
  if (!flags.output.empty()) require_writable_cloud(flags.output);
  const Progress progress = interruptible_progress();
  const Executor executor(flags.threads);
  std::vector<std::shared_ptr<const SurfelMap>> maps;
  for (const std::string& input : flags.inputs) {
    maps.push_back(as_map(flags, input, executor, progress));
  }
  const double r = std::max(maps[0]->resolution(), maps[1]->resolution());
  const double distance = flags.distance > 0.0 ? flags.distance : std::max(0.2, 3.0 * r);
  std::unique_ptr<CloudWriter> writer;
  if (!flags.output.empty()) {
    writer = write_cloud(OutputFile(flags.output), {.intensity = true, .color = true});
  }
  std::vector<OneWay> ways(2);
  picture::PointSample all;
  maps[0]->for_each_surfel(
      [&](const Vector3d& p, const Vector3d&, double, std::uint32_t) { all.add(p); });
  for (std::size_t i = 0; i < 2; ++i) {
    OneWay& way = ways[i];
    way.name = flags.inputs[i];
    std::vector<CloudPoint> points;
    const auto flush = [&] {
      if (writer) writer->write(std::span<const CloudPoint>(points));
      points.clear();
    };
    way.surfels = for_each_missing(
        *maps[i],
        *maps[1 - i],
        distance,
        10.0 * distance,
        executor,
        [&](const Vector3d& p, double d) {
          ++way.missing;
          way.where.add(p);
          way.sample.add(p);
          points.push_back({p, static_cast<float>(d), bytes_of(i == 0 ? kOnlyFirst : kOnlySecond)});
          if (points.size() >= 16384) flush();
        },
        progress);
    flush();
  }
  end_progress();
  OutputSet outputs;
  if (writer) {
    writer->commit();
    log(
        fmt::format("{}: {} places; intensity: metres to the other, at most {:.3g}; red: only in "
                    "the first, blue: only in the second",
                    flags.output,
                    writer->count(),
                    10.0 * distance));
  }
  if (!flags.png.empty()) draw_diff(flags, ways, distance, all);
  outputs.commit();
  if (flags.json) {
    print_json(json_of(ways, distance));
  } else {
    print_diff(ways, distance);
  }
}

}  // namespace

void add_export(CLI::App& parent) {
  auto* app = parent.add_subcommand("export", "Write a map as a cloud, or a cloud as another kind");
  auto flags = std::make_shared<ExportFlags>();
  app->add_option("input", flags->inputs, "A .pfmap, or a cloud or mesh")->required()->expected(1);
  add_edit_flags(*app, *flags, "The cloud to write: .pcd, .ply, .las", true);
  app->add_option("--what",
                  flags->what,
                  "Of a map: points, normals (points with them; the default but for LAS), surfels "
                  "(normals, deviations s0 s1 s2 in m, quaternion)")
      ->check(CLI::IsMember({"points", "normals", "surfels"}));
  app->add_option("--density",
                  flags->density,
                  "Points a square metre, spread over the surfels; without it one per surfel")
      ->check(within(0.01, 1e8));
  app->footer("  pointflight map export hall.pfmap -o hall.ply");
  app->callback([flags] { export_map(*flags); });
}

void add_diff(CLI::App& parent) {
  auto* app = parent.add_subcommand("diff", "What is in one map or cloud and not in another");
  auto flags = std::make_shared<DiffFlags>();
  app->add_option("inputs", flags->inputs, "Two .pfmap or clouds")->required()->expected(2);
  add_edit_flags(*app, *flags, "Write the differing places as a cloud: .pcd, .ply, .las", false);
  app->add_option("--distance",
                  flags->distance,
                  "What lies farther than this from the other differs, m; default: 0.2, or 3 "
                  "resolutions")
      ->check(within(1e-3, 1e4));
  app->add_option("--resolution", flags->resolution, "Of clouds, m; without it by their spacing")
      ->check(within(1e-4, 1e4));
  app->add_flag("--json", flags->json, "JSON on stdout");
  app->footer("  pointflight map diff before.pfmap after.pfmap --png diff.png -o diff.ply");
  app->callback([flags] { diff(*flags); });
}

}  // namespace pointflight::apps
