#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "apps/commands.hpp"
#include "apps/flags.hpp"
#include "apps/terminal.hpp"
#include "apps/world_flags.hpp"
#include "apps/world_survey.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/output_file.hpp"
#include "pointflight/core/parallel.hpp"
#include "pointflight/picture/pictures.hpp"
#include "pointflight/scenes/scene_class.hpp"
#include "pointflight/scenes/world_map.hpp"

namespace pointflight::apps {
namespace {

using Json = nlohmann::ordered_json;

struct WorldFlags {
  WorldOptions options;
  std::vector<std::string> chosen;  ///< --set
  std::string output;
  std::string png;
  double resolution = 0.05;
  bool has_resolution = false;  ///< It was given.
  WorldSurveyFlags survey;
  int threads = 0;
  bool json = false;
  bool force = false;
};

std::string size_of(const WorldKind& kind) {
  return fmt::format("{:.0f} x {:.0f} x {:.0f} m", kind.size.x(), kind.size.y(), kind.size.z());
}

picture::WorldPicture picture_of(std::shared_ptr<const SurfelMap> map,
                                 const WorldOptions& options) {
  const WorldKind& kind = *WorldKind::table().find(options.name);
  std::vector<picture::Color> colors = {picture::kInk};  // of 0, which nothing is known of
  for (const SceneClass& of : scene_classes()) {
    const auto part = [&](int shift) {
      return static_cast<double>(of.color >> shift & 255u) / 255;
    };
    colors.push_back({part(16), part(8), part(0)});
  }
  return {std::move(map),
          fmt::format("{}, seed {}", kind.name, options.seed),
          kind.view.from,
          kind.view.to,
          std::move(colors)};
}

/// All of them on a sheet.
void draw_all(const WorldFlags& flags) {
  check_outputs({flags.png}, {}, flags.force);
  std::vector<picture::WorldPicture> pictures;
  const Progress progress = interruptible_progress();
  const auto all = static_cast<double>(WorldKind::table().rows().size());
  for (const WorldKind& kind : WorldKind::table().rows()) {
    progress(kind.name, static_cast<double>(pictures.size()) / all);
    const WorldOptions options{kind.name, flags.options.seed, {}};
    pictures.push_back(
        picture_of(open_world_map({options, flags.resolution}, Executor()), options));
  }
  end_progress();
  picture::draw_worlds(pictures, flags.png);
}

void print_worlds(const WorldFlags& flags) {
  Json all = Json::array();
  for (const WorldKind& kind : WorldKind::table().rows()) {
    if (!flags.json) {
      fmt::print("{:<20} {:>16}  {}\n", kind.name, size_of(kind), kind.help);
      continue;
    }
    all.push_back({{"name", kind.name},
                   {"size", {kind.size.x(), kind.size.y(), kind.size.z()}},
                   {"help", kind.help}});
  }
  if (flags.json) fmt::print("{}\n", all.dump(2));
  if (!flags.png.empty()) draw_all(flags);
}

void show_world(WorldFlags& flags) {
  read_chosen(flags.chosen, flags.options);
  const WorldValues values = values_of(flags.options);
  const WorldKind& kind = *WorldKind::table().find(flags.options.name);
  Json json{{"name", kind.name},
            {"size", {kind.size.x(), kind.size.y(), kind.size.z()}},
            {"help", kind.help},
            {"seed", flags.options.seed},
            {"parameters", Json::object()}};
  for (const WorldParameter& p : kind.parameters) {
    json["parameters"][p.name] = {
        {"low", p.low}, {"high", p.high}, {"value", values[p.name]}, {"help", p.help}};
  }
  if (flags.json) {
    fmt::print("{}\n", json.dump(2));
    return;
  }
  fmt::print("{}, about {}: {}\n", kind.name, size_of(kind), kind.help);
  fmt::print("  {:<12} {:>8} {:>8} {:>10}\n",
             "parameter",
             "from",
             "to",
             fmt::format("seed {}", flags.options.seed));
  for (const WorldParameter& p : kind.parameters) {
    fmt::print("  {:<12} {:>8.4g} {:>8.4g} {:>10.4g}  {}\n",
               p.name,
               p.low,
               p.high,
               values[p.name],
               p.help);
  }
}

void write_truth(const WorldMapOptions& options, const std::string& path) {
  const std::string text = world_truth(options, make_world(options.world));
  OutputFile file(path);
  file.write(std::as_bytes(std::span(text)));
  file.commit();
}

void make_world_file(WorldFlags& flags) {
  const auto start = std::chrono::steady_clock::now();
  read_chosen(flags.chosen, flags.options);
  const std::string truth =
      std::filesystem::path(flags.output).replace_extension(".truth").string();
  if (truth == flags.output) throw InputError(flags.output + ": its truth has this name; .pfmap");
  check_outputs({flags.output, truth, flags.png}, {}, flags.force);
  values_of(flags.options);  // refuses what is wrong before anything begins
  OutputFile output(flags.output);
  const Executor executor(flags.threads);
  const Progress progress = interruptible_progress();
  std::uint64_t surfels = 0;
  if (flags.survey.on) {
    std::optional<double> resolution;
    if (flags.has_resolution) resolution = flags.resolution;
    const PictureFolder scans(flags.survey.scans, flags.force);
    EditedMap made = survey_world(flags.options, flags.survey, resolution, executor, progress);
    surfels = made.surfels;
    flags.resolution = made.description.resolution;
    set_world(made.description, {flags.options, flags.resolution});
    write_map(std::move(output), made.tree, made.description);
  } else {
    const ImportedMap made = make_world_map({flags.options, flags.resolution}, executor, progress);
    surfels = made.report.surfels;
    write_map(std::move(output), made.tree, made.description);
  }
  write_truth({flags.options, flags.resolution}, truth);
  end_progress();
  if (!flags.png.empty()) {
    const picture::WorldPicture picture = picture_of(SurfelMap::open(flags.output), flags.options);
    picture::draw_worlds({&picture, 1}, flags.png);
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  log(fmt::format("{} surfels at {:.4g} m in {:.1f} s",
                  short_count(static_cast<double>(surfels)),
                  flags.resolution,
                  took.count()));
  fmt::print("{}\n", flags.output);
}

CLI::Option* add_resolution(CLI::App& app, WorldFlags& flags) {
  return app.add_option("--resolution", flags.resolution, "Of maps, m")
      ->check(within(0.02, 1.0))
      ->capture_default_str();
}

}  // namespace

void read_chosen(const std::vector<std::string>& words, WorldOptions& options) {
  for (const std::string& text : words) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos) {
      throw InputError(fmt::format("--set {}: NAME=VALUE is wanted", text));
    }
    options.chosen[text.substr(0, equals)] =
        parse_numbers(text.substr(equals + 1), 1, "--set", "NAME=VALUE").front();
  }
}

void add_world_options(CLI::App& app, WorldOptions& options, std::vector<std::string>& chosen) {
  app.add_option("world", options.name, "Its name: pointflight world list")->required();
  app.add_option("--seed", options.seed, "Another seed, another world of this kind")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--set", chosen, "NAME=VALUE of a parameter, else drawn by the seed");
}

void add_world_command(CLI::App& parent, int& /*exit_code*/) {
  auto* app = parent.add_subcommand("world", "Made-up worlds, as many of each kind as seeds");
  app->require_subcommand(1);
  auto flags = std::make_shared<WorldFlags>();
  auto* list = app->add_subcommand("list", "All kinds, with their sizes");
  list->add_flag("--json", flags->json, "JSON on stdout");
  auto* png = list->add_option("--png", flags->png, "A picture of all, which takes minutes");
  add_resolution(*list, *flags)->needs(png);
  list->add_option("--seed", flags->options.seed, "Of the picture's worlds")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str()
      ->needs(png);
  add_force_flag(*list, flags->force);
  list->callback([flags] { print_worlds(*flags); });
  auto* show = app->add_subcommand("show", "The parameters of a kind, and what a seed draws");
  add_world_options(*show, flags->options, flags->chosen);
  show->add_flag("--json", flags->json, "JSON on stdout");
  show->callback([flags] { show_world(*flags); });
  auto* make = app->add_subcommand("make", "The map of a world, as a perfect scan gives it");
  add_world_options(*make, flags->options, flags->chosen);
  make->add_option("-o,--output", flags->output, "The .pfmap to write")->required();
  add_resolution(*make, *flags);
  make->add_option("--png", flags->png, "A picture of it: from outside and from inside");
  make->add_option("--threads", flags->threads, "0: all")->check(CLI::NonNegativeNumber);
  add_force_flag(*make, flags->force);
  add_world_survey_flags(*make, flags->survey);
  make->callback([flags, make] {
    flags->has_resolution = make->count("--resolution") > 0;
    make_world_file(*flags);
  });
  add_world_tasks_command(*app);
}

}  // namespace pointflight::apps
