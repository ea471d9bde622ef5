#include <fmt/format.h>

#include <utility>

#include "apps/cli.hpp"
#include "apps/flags.hpp"
#include "apps/map_edit.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/map/edit/crop_region.hpp"

namespace pointflight::apps {
namespace {

// ---- crop ----

struct CropFlags : EditFlags {
  std::string box;
  std::string polygon;
  double min_height = -1e9;
  double max_height = 1e9;
  double ground_window = 12.0;
  bool outside = false;
};

CropRegion region_of(const CropFlags& flags) {
  CropRegion region;
  region.outside = flags.outside;
  region.above_ground_min = flags.min_height;
  region.above_ground_max = flags.max_height;
  if (!flags.box.empty()) {
    region.box = box_from(
        parse_numbers(
            flags.box, 6, "--box", "x,y,z of the lower corner, then of the upper, in metres"),
        "--box");
  }
  if (!flags.polygon.empty()) {
    const std::vector<double> numbers = parse_numbers(flags.polygon, "--polygon");
    if (numbers.size() < 6 || numbers.size() % 2 != 0) {
      throw InputError("--polygon: three corners or more are wanted: x,y,x,y,x,y (metres)");
    }
    for (std::size_t i = 0; i < numbers.size(); i += 2) {
      region.polygon.push_back({numbers[i], numbers[i + 1]});
    }
  }
  return region;
}

std::string describe(const CropFlags& flags) {
  std::string note = "crop";
  if (!flags.box.empty()) note += " --box " + flags.box;
  if (!flags.polygon.empty()) note += " --polygon " + flags.polygon;
  if (flags.min_height > -1e9) note += fmt::format(" --min-height {}", flags.min_height);
  if (flags.max_height < 1e9) note += fmt::format(" --max-height {}", flags.max_height);
  if (flags.outside) note += " --outside";
  return note;
}

void crop_cloud(const CropFlags& flags, CropRegion region, bool asks_ground) {
  const Progress progress = interruptible_progress();
  const CloudSource source = only_cloud(flags, progress);
  std::uint64_t points = 0;
  if (asks_ground) {
    auto ground = std::make_shared<GroundHeight>(flags.ground_window);
    stream_points(
        source, points, "finding the ground", progress, [&](std::vector<CloudPoint>& batch) {
          for (const CloudPoint& point : batch) ground->add(point.position);
        });
    ground->finish();
    region.ground = ground;
  }
  CloudOutput output(flags, columns_of_edit(source, progress));
  points = 0;
  const std::uint64_t not_finite =
      stream_points(source, points, "cropping", progress, [&](std::vector<CloudPoint>& batch) {
        std::erase_if(batch, [&](const CloudPoint& p) { return !region.contains(p.position); });
        output.write(std::span<const CloudPoint>(batch));
      });
  output.finish(points, not_finite, "kept");
}

void crop_surfels(const CropFlags& flags, CropRegion region, bool asks_ground) {
  OutputFile output(flags.output);
  const auto map = open_sound_map(flags.inputs.front());
  if (asks_ground) {
    auto ground = std::make_shared<GroundHeight>(flags.ground_window);
    map->for_each_surfel([&](const Vector3d& center, const Vector3d&, double, std::uint32_t) {
      ground->add(center);
    });
    ground->finish();
    region.ground = ground;
  }
  const Executor executor(flags.threads);
  const EditedMap edited = crop_map(
      *map,
      [&](const Vector3d& center) { return region.contains(center); },
      edit_options(flags, describe(flags)),
      executor);
  finish_map(flags, std::move(output), edited);
}

void crop(const CropFlags& flags) {
  const bool asks_ground = flags.min_height > -1e9 || flags.max_height < 1e9;
  const CropRegion region = region_of(flags);
  if (!region.box && region.polygon.empty() && !asks_ground) {
    throw InputError(
        "nothing says what to keep; give --box, --polygon, --min-height or --max-height");
  }
  if (check_edit(flags)) {
    crop_surfels(flags, region, asks_ground);
  } else {
    crop_cloud(flags, region, asks_ground);
  }
}

// ---- thin ----

struct ThinFlags : EditFlags {
  double spacing = 0.0;
  std::uint64_t every = 0;
};

void thin(const ThinFlags& flags) {
  if ((flags.spacing > 0.0) == (flags.every > 0)) {
    throw InputError("give one of --spacing (a point per cell) and --every (each n-th point)");
  }
  if (check_edit(flags)) {
    throw InputError(fmt::format(
        "{}: a map has one surfel per cell; import its cloud again with a coarser --resolution",
        flags.inputs.front()));
  }
  const Progress progress = interruptible_progress();
  const CloudSource source = only_cloud(flags, progress);
  CloudColumns columns = columns_of_edit(source, progress);
  if (flags.every > 0) {
    CloudOutput output(flags, columns);
    std::uint64_t points = 0;
    std::uint64_t at = 0;
    const std::uint64_t not_finite =
        stream_points(source, points, "thinning", progress, [&](std::vector<CloudPoint>& batch) {
          std::erase_if(batch, [&](const CloudPoint&) { return at++ % flags.every != 0; });
          output.write(std::span<const CloudPoint>(batch));
        });
    output.finish(points, not_finite, "kept");
    return;
  }
  if (columns.color) log("colours       kept as intensities: means of cells have no colour");
  columns = {.intensity = columns.intensity || columns.color};
  CloudOutput output(flags, columns);
  ImportOptions options;
  options.scratch_folder = scratch_of(flags);
  const ThinReport report =
      thin_cloud([&] { return source.open({}, progress); },
                 flags.spacing,
                 options,
                 Executor(flags.threads),
                 [&](std::span<const CloudPoint> points) { output.write(points); },
                 progress);
  output.finish(report.points_read, report.points_dropped, "thinned to");
}

}  // namespace

void add_crop(CLI::App& parent) {
  auto* app =
      parent.add_subcommand("crop", "Keep a part of a map or cloud: a box, a polygon, heights");
  auto flags = std::make_shared<CropFlags>();
  add_input(*app, *flags);
  add_edit_flags(
      *app, *flags, "What to write: a .pfmap of a .pfmap; .pcd, .ply, .las of clouds", true);
  app->add_option("--box", flags->box, "x,y,z,x,y,z of two corners, m");
  app->add_option("--polygon", flags->polygon, "x,y,x,y,x,y,... of its corners seen from above, m");
  app->add_option("--max-height",
                  flags->max_height,
                  "Metres above the ground; cuts a ceiling or crowns away")
      ->check(within(-1e4, 1e4));
  app->add_option("--min-height", flags->min_height, "Metres above the ground; cuts it away")
      ->check(within(-1e4, 1e4));
  app->add_option("--ground-window",
                  flags->ground_window,
                  "Width of the widest thing that hides the ground, m")
      ->check(within(0.5, 200.0))
      ->capture_default_str();
  app->add_flag("--outside", flags->outside, "Keep the rest instead");
  app->footer(
      "All that is given has to hold. A map's surfels are kept or dropped by their centres and "
      "stay "
      "what they are.\n"
      "  pointflight map crop hall.pfmap -o low.pfmap --max-height 6 --png low.png");
  app->callback([flags] { crop(*flags); });
}

void add_thin(CLI::App& parent) {
  auto* app = parent.add_subcommand("thin", "Fewer points: one per cell, or each n-th");
  auto flags = std::make_shared<ThinFlags>();
  add_input(*app, *flags);
  add_edit_flags(*app, *flags, "The cloud to write: .pcd, .ply, .las", true);
  app->add_option("--spacing", flags->spacing, "The mean of the points in each cell this wide, m")
      ->check(within(1e-4, 1e4));
  app->add_option("--every", flags->every, "Each n-th point, as it is")
      ->check(CLI::Range(2, 1000000000));
  app->footer("  pointflight map thin scan.las -o thin.las --spacing 0.03");
  app->callback([flags] { thin(*flags); });
}

}  // namespace pointflight::apps
