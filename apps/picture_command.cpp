#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <system_error>

#include "apps/cli.hpp"
#include "apps/commands.hpp"
#include "apps/flags.hpp"
#include "apps/input_kind.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/core/owned_files.hpp"
#include "pointflight/io/cloud_reader.hpp"
#include "pointflight/io/csv_table.hpp"
#include "pointflight/picture/film.hpp"
#include "pointflight/picture/pictures.hpp"
#include "pointflight/sim/run_folder.hpp"

namespace pointflight::apps {
namespace {

namespace fs = std::filesystem;

struct PictureFlags {
  std::string run;
  std::string map;
  std::string output;
  std::string frames;
  std::string video;
  std::size_t follow = 0;
  double rate = 20.0;
  bool force = false;
};

/// Lines of a text file split at commas, the first left out; for tables with words in them.
std::vector<std::vector<std::string>> rows_of(const fs::path& path) {
  std::error_code ignored;
  if (!fs::exists(path, ignored))
    throw InputError(fmt::format("{}: cannot open; is this a run's folder?", path.string()));
  require_regular_file(path.string());
  std::ifstream file(path);
  std::vector<std::vector<std::string>> rows;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::vector<std::string> cells;
    std::stringstream cut(line);
    for (std::string cell; std::getline(cut, cell, ',');) cells.push_back(cell);
    rows.push_back(std::move(cells));
  }
  return rows;
}

double number_of(const std::string& text, const fs::path& path) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (end == text.c_str()) {
    throw InputError(fmt::format("{}: '{}' is no number", path.string(), text));
  }
  return value;
}

void read_vehicle(const fs::path& folder, std::size_t number, picture::RunPicture& picture) {
  const CsvTable table((folder / "trajectory.csv").string());
  const int x = table.require("px");
  const int y = table.require("py");
  const int z = table.require("pz");
  for (std::size_t row = 0; row < table.rows(); ++row) {
    picture.add_path_point(number, {table.at(row, x), table.at(row, y), table.at(row, z)});
  }
  const fs::path scans = folder / "scans.csv";
  if (!fs::exists(scans)) return;
  constexpr std::size_t kColumns = 14;
  std::size_t offered = 0;
  const Folder own(folder.string());
  for (const auto& row : rows_of(scans)) {
    if (row.size() < kColumns) throw InputError(fmt::format("{}: short row", scans.string()));
    std::array<double, 7> pose{};
    for (std::size_t i = 0; i < pose.size(); ++i) pose[i] = number_of(row[7 + i], scans);
    const Pose T_world_sensor{Quaterniond(pose[3], pose[4], pose[5], pose[6]).normalized(),
                              {pose[0], pose[1], pose[2]}};
    const auto reader = open_cloud(file_of_run(own, row[0], scans.string()));
    std::vector<CloudPoint> points;
    while (reader->read(points)) {
      for (const CloudPoint& point : points) {
        if (offered++ % picture::RunPicture::kSeenStride == 0) {
          picture.seen.add(T_world_sensor * point.position);
        }
      }
    }
  }
}

picture::RunPicture read_run(const fs::path& folder) {
  picture::RunPicture picture;
  nlohmann::json summary;
  try {
    require_regular_file((folder / "summary.json").string());
    summary = nlohmann::json::parse(std::ifstream(folder / "summary.json"));
    const auto& vehicles = summary.at("vehicles");
    picture::RunFigures figures;
    figures.vehicles = vehicles.size();
    if (summary.contains("others")) figures.others = summary.at("others").size();
    figures.time = summary.at("simulated_time").get<double>();
    figures.end = summary.at("end").get<std::string>();
    for (const auto& vehicle : vehicles) {
      const std::string name = vehicle.at("name").get<std::string>();
      // one of several, if other processes flew the rest
      const bool has_folder = fs::exists(folder / name / "trajectory.csv");
      read_vehicle(has_folder ? folder / name : folder, picture.names.size(), picture);
      picture.names.push_back(name);
      figures.flown += vehicle.at("distance_flown").get<double>();
      figures.scans += vehicle.at("scans").get<std::uint64_t>();
      figures.points += vehicle.at("points").get<std::uint64_t>();
      figures.collisions += vehicle.at("collisions").get<std::uint64_t>();
      if (vehicle.at("closest_approach").is_number()) {
        figures.add_closest(vehicle.at("closest_approach").get<double>());
      }
    }
    picture::write_titles(figures, picture);
  } catch (const nlohmann::json::exception&) {
    throw InputError(fmt::format("{}: not the summary of a run; give the folder of `fly -o`",
                                 (folder / "summary.json").string()));
  }
  const fs::path obstacles = folder / "obstacles.csv";
  if (fs::exists(obstacles) && fs::file_size(obstacles) > 0) {
    const auto rows = rows_of(obstacles);
    for (const auto& row : rows) {
      if (row.size() < 12) throw InputError(fmt::format("{}: short row", obstacles.string()));
      picture.add_obstacle(static_cast<std::uint32_t>(number_of(row[1], obstacles)),
                           {number_of(row[2], obstacles),
                            number_of(row[3], obstacles),
                            number_of(row[4], obstacles)},
                           number_of(row[9], obstacles));
    }
  }
  const fs::path events = folder / "events.csv";
  for (const auto& row : rows_of(events)) {
    if (row.size() < 10 || row[1] != "collision") continue;
    picture.collisions.add(
        {number_of(row[7], events), number_of(row[8], events), number_of(row[9], events)});
  }
  return picture;
}

/// The scenario that a run was flown from; nothing if its folder has none.
std::optional<Scenario> scenario_of(const PictureFlags& flags) {
  const fs::path file = fs::path(flags.run) / "scenario.yaml";
  if (!fs::exists(file)) return std::nullopt;
  return load_scenario(file.string());
}

/// The map that a run's scenario names, or the one that is given instead: the same, where the run
/// says which that was.
std::shared_ptr<const SurfelMap> map_of(const PictureFlags& flags,
                                        std::optional<Scenario> scenario) {
  if (!scenario) {
    if (!flags.map.empty()) return SurfelMap::open(flags.map);
    throw InputError(fmt::format("{}: is missing; give the map of the flight with --map",
                                 (fs::path(flags.run) / "scenario.yaml").string()));
  }
  if (!flags.map.empty()) scenario->map = fs::absolute(flags.map).string();
  return scenario->open_map();
}

/// A folder that goes with its pictures, among the system's temporary ones.
class FrameFolder {
 public:
  FrameFolder() {
    std::string name = (fs::temp_directory_path() / "pointflight_film_XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) {
      throw InputError(fmt::format("{}: {}", name, std::generic_category().message(errno)));
    }
    folder_.emplace(name);
  }
  ~FrameFolder() {
    for (const std::string& picture : folder_->names()) folder_->remove_file(picture);
    ::rmdir(path().c_str());
  }
  FrameFolder(const FrameFolder&) = delete;
  FrameFolder& operator=(const FrameFolder&) = delete;
  [[nodiscard]] const std::string& path() const { return folder_->path(); }

 private:
  std::optional<Folder> folder_;
};

constexpr const char* kOverview = "overview.png";

/// True if the run's list of files has the picture.
bool lists_picture(const std::string& run) {
  const auto files = read_file_list(Folder(run));
  return files &&
         std::ranges::any_of(*files, [](const ListedFile& file) { return file.name == kOverview; });
}

/// The picture is a part of the run from now on: `fly --force` removes it with the rest.
void list_picture(const std::string& run) {
  const Folder folder(run);
  auto files = read_file_list(folder);
  if (!files || lists_picture(run)) return;
  files->push_back({kOverview, false});
  folder.write(kFileList, file_list_text(*files));
}

void film(const PictureFlags& flags) {
  check_outputs({flags.video}, {flags.run, flags.map}, flags.force);
  if (!flags.frames.empty()) make_picture_folder(flags.frames, flags.force);
  const Executor executor(0);
  RecordedRun run(flags.run, executor);
  const FrameFolder own;
  picture::FilmOptions options;
  options.frames = flags.frames.empty() ? own.path() : flags.frames;
  options.vehicle = flags.follow;
  options.rate = flags.rate;
  const std::size_t pictures = picture::film_run(run, options, interruptible_progress());
  end_progress();
  if (!flags.frames.empty()) fmt::print("{} pictures in {}\n", pictures, flags.frames);
  if (flags.video.empty()) return;
  picture::make_video(options, flags.video);
  fmt::print("{}\n", flags.video);
}

}  // namespace

void add_picture_command(CLI::App& parent, int& /*exit_code*/) {
  auto* app = parent.add_subcommand("picture", "Draw a run from its folder");
  auto flags = std::make_shared<PictureFlags>();
  app->add_option("run", flags->run, "A folder that `fly` or a program of yours wrote")->required();
  app->add_option("--map", flags->map, "Where the map lies now, if not where the run says");
  app->add_option("-o,--output", flags->output, "The .png; else overview.png in the folder");
  app->add_option(
      "--video", flags->video, "Instead: a film of it (.mp4), from behind a vehicle; takes ffmpeg");
  app->add_option("--frames", flags->frames, "The same as pictures, in a folder");
  app->add_option("--follow", flags->follow, "Number of the vehicle that is followed")
      ->check(CLI::Range(0, 100000));
  app->add_option("--fps", flags->rate, "Pictures per second of the run")
      ->check(within(0.1, 240.0))
      ->capture_default_str();
  add_force_flag(*app, flags->force);
  app->footer("Example: pointflight picture run --video run.mp4");
  app->callback([flags] {
    require_kind(flags->run, {InputKind::kRun}, "the folder of a run (fly -o)");
    if (!fs::exists(flags->run)) {
      throw InputError(flags->run + ": no such folder; give the one that `fly -o` wrote");
    }

    if (!flags->video.empty() || !flags->frames.empty()) return film(*flags);
    const std::string own = (fs::path(flags->run) / kOverview).string();
    const std::string path = flags->output.empty() ? own : flags->output;
    const bool is_own = flags->output.empty() && lists_picture(flags->run);
    // the run's own picture may be drawn again
    check_outputs({path}, {flags->run, flags->map}, flags->force || is_own);
    const auto scenario = scenario_of(*flags);
    const auto map = map_of(*flags, scenario);
    picture::RunPicture picture = read_run(flags->run);
    if (scenario) {
      for (const VehicleSetup& vehicle : scenario->fleet()) {
        picture.waypoints.push_back(vehicle.mission.waypoints);
      }
    }
    picture::draw_overview(*map, picture, path);
    if (flags->output.empty()) list_picture(flags->run);
    fmt::print("{}\n", path);
  });
}

}  // namespace pointflight::apps
