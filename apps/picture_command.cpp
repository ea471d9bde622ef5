#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <system_error>

#include "apps/cli.hpp"
#include "apps/commands.hpp"
#include "apps/flags.hpp"
#include "apps/input_kind.hpp"
#include "apps/named_map.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/owned_files.hpp"
#include "pointflight/picture/film.hpp"
#include "pointflight/picture/pictures.hpp"
#include "pointflight/picture/run_folder_picture.hpp"
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
  std::optional<std::size_t> follow;
  double rate = 20.0;
  bool force = false;
};

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
  if (!flags.map.empty()) {
    scenario->map = fs::absolute(flags.map).string();
    scenario->world.reset();
  }
  return open_map_of(*scenario);
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
  const PictureFolder frames(flags.frames, flags.force);
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
  app->add_option("--follow",
                  flags->follow,
                  "Number of the vehicle that is followed; else the first of this folder")
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
    picture::RunPicture picture = picture::read_run_picture(flags->run);
    if (scenario) {
      // of a shared run the folder has some of them
      picture.waypoints.resize(picture.names.size());
      for (const VehicleSetup& vehicle : scenario->fleet()) {
        const auto name = std::ranges::find(picture.names, vehicle.name);
        if (name == picture.names.end()) continue;
        picture.waypoints[static_cast<std::size_t>(name - picture.names.begin())] =
            vehicle.mission.waypoints;
      }
    }
    picture::draw_overview(*map, picture, path);
    if (flags->output.empty()) list_picture(flags->run);
    fmt::print("{}\n", path);
  });
}

}  // namespace pointflight::apps
