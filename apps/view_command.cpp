#include <fmt/format.h>

#include <array>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "apps/cli.hpp"
#include "apps/commands.hpp"
#include "apps/input_kind.hpp"
#include "apps/survey_flags.hpp"
#include "apps/terminal.hpp"
#include "apps/view_flags.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/recording/mcap_reader.hpp"
#include "pointflight/ros/common/profile.hpp"
#include "pointflight/ros/common/ros_link.hpp"
#include "pointflight/run/playback.hpp"
#include "pointflight/view/foxglove_transport.hpp"
#include "pointflight/view/recording_playback.hpp"
#include "pointflight/view/view_link.hpp"

namespace pointflight::apps {
namespace {

namespace fs = std::filesystem;

struct ViewCommandFlags {
  std::string input;
  std::string map;
  std::string at;
  bool control = false;
  bool no_control = false;
  int threads = 0;
};

ViewAccess access_of(const ViewCommandFlags& flags) {
  return {flags.at, flags.control, flags.no_control};
}

/// A map alone, until it is interrupted.
void view_map(const ViewCommandFlags& flags) {
  const auto map = SurfelMap::open(flags.input);
  const auto server = serve_view(access_of(flags), map);
  catch_interrupts();
  while (!interrupted()) std::this_thread::sleep_for(std::chrono::milliseconds(50));
}

/// A finished run, to be played as viewers like.
void view_run(const ViewCommandFlags& flags) {
  const Executor executor(flags.threads);
  RecordedRun run(flags.input, executor);
  const RunDescription& description = run.description();
  const Duration epoch = kFixedEpoch;
  const std::pair range(epoch.count(), (run.end().time_since_epoch() + epoch).count());
  const auto server = serve_view(access_of(flags), description.map, range);
  RosLinkOptions options;
  options.epoch = epoch;
  options.log = [](const std::string& line) { log(line); };
  RosLink ros(description, load_ros_profile("default"), std::move(options));
  ros.add_transport(std::make_unique<FoxgloveTransport>(server));
  ViewLink view(server, epoch);
  view.let_play_back();
  catch_interrupts();
  PlaybackOptions playback;
  playback.rate = 1.0;
  playback.interrupted = interrupted;
  playback.controlled = true;
  playback.on_status = [&](const PlaybackStatus& status) { view.publish_playback(status); };
  const std::array<Link*, 2> links = {&ros, &view};
  play(run, links, playback);
}

/// A recording as it lies there, whoever made it.
void view_recording(const ViewCommandFlags& flags) {
  const auto map = flags.map.empty() ? nullptr : SurfelMap::open(flags.map);
  const auto recording = open_timed_mcap(flags.input, terminal_progress());
  const auto server = serve_view(access_of(flags), map, recording->range());
  catch_interrupts();
  play(*recording, *server, interrupted);
}

/// The recording in a folder that `ros2 bag record` made; nothing if it is another folder.
std::optional<std::string> recording_in(const std::string& folder) {
  std::error_code ignored;
  const bool is_recording = kind_of_input(folder) == InputKind::kRecordingFolder ||
                            fs::exists(fs::path(folder) / "metadata.yaml", ignored);
  if (!is_recording) return std::nullopt;
  std::vector<std::string> found = recordings_in(folder);
  std::erase_if(found, [](const std::string& path) { return !path.ends_with(".mcap"); });
  if (found.empty()) {
    throw InputError(fmt::format(
        "{}: is a recording without an .mcap file; ros2 bag convert makes one", folder));
  }
  if (found.size() > 1) {
    throw InputError(
        fmt::format("{}: is a recording in {} .mcap files: give one of them, such as {}",
                    folder,
                    found.size(),
                    found.front()));
  }
  return found.front();
}

int view(ViewCommandFlags flags) {
  std::error_code ignored;
  require_kind(
      flags.input,
      {InputKind::kMap, InputKind::kRun, InputKind::kRecording, InputKind::kRecordingFolder},
      "a map (.pfmap), the folder of a run or a recording (.mcap)");
  const bool is_folder = fs::is_directory(flags.input, ignored);
  if (const auto inside = is_folder ? recording_in(flags.input) : std::nullopt) {
    flags.input = *inside;
  }
  const bool is_recording = flags.input.ends_with(".mcap") || flags.input.ends_with(".mcap.active");
  if (!flags.map.empty() && !is_recording) {
    throw InputError("--map goes with a recording (.mcap); runs know their map");
  }
  if (is_recording) {
    view_recording(flags);
  } else if (is_folder) {
    view_run(flags);
  } else if (flags.input.ends_with(".pfmap")) {
    view_map(flags);
  } else if (flags.input.ends_with(".bag") || flags.input.ends_with(".db3")) {
    throw InputError(fmt::format(
        "{}: recordings are shown as .mcap: `mcap convert` or `ros2 bag convert` makes one of it",
        flags.input));
  } else {
    throw InputError(fmt::format("{}: is no folder of a run, no map (.pfmap), no recording (.mcap)",
                                 flags.input));
  }
  return kDone;
}

}  // namespace

void add_view_command(CLI::App& parent, int& exit_code) {
  auto* app = parent.add_subcommand(
      "view",
      "Show a map, a finished run or a recording with a time line, in a browser; until Ctrl-C");
  auto flags = std::make_shared<ViewCommandFlags>();
  app->add_option("input", flags->input, "A .pfmap, the folder of a run, or an .mcap")
      ->required()
      ->check(CLI::ExistingPath);
  app->add_option("--map", flags->map, "The .pfmap to draw around a recording")
      ->check(CLI::ExistingFile);
  app->add_option("--at",
                  flags->at,
                  "ADDRESS:PORT; 127.0.0.1:8765 or the next port that is free, so that only this "
                  "machine can connect");
  auto* control = app->add_flag("--view-control",
                                flags->control,
                                "Viewers may play, pause and jump (the default where only this "
                                "machine can connect)");
  app->add_flag("--no-view-control", flags->no_control, "They may only watch")->excludes(control);
  app->add_option("--threads", flags->threads, "0: all cores")->check(CLI::Range(0, 1024));
  app->footer("Example: pointflight view run.mcap --map forest.pfmap");
  app->callback([flags, &exit_code] { exit_code = view(*flags); });
}

}  // namespace pointflight::apps
