#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "apps/cli.hpp"
#include "apps/command_line.hpp"
#include "apps/commands.hpp"
#include "apps/memory_reserve.hpp"
#include "apps/modules.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/core/version.hpp"
#include "pointflight/gpu/gpu_renderer.hpp"
#include "pointflight_commit.hpp"

namespace {

/// "pointflight 0.1.0" and what this build can do.
std::string version_text() {
  using pointflight::apps::has_module;
  const auto yes = [](bool has) { return has ? "yes" : "no"; };
  return fmt::format("pointflight {} ({})\nmeshes  {}\nROS 1   {}\nROS 2   {}",
                     pointflight::kVersion,
                     POINTFLIGHT_COMMIT,
                     yes(POINTFLIGHT_WITH_MESHES != 0),
                     yes(has_module("pointflight_ros1")),
                     yes(has_module("pointflight_ros2")));
}

void add_shell_commands(CLI::App& app) {
  auto* completion = app.add_subcommand(
      "completion", "Print a completion script: source <(pointflight completion) in ~/.bashrc");
  completion->callback([&app] { fmt::print("{}", pointflight::apps::bash_completion(app)); });
  auto* man =
      app.add_subcommand("man", "Print this program's manual page: pointflight man | man -l -");
  man->callback(
      [&app] { fmt::print("{}", pointflight::apps::man_page(app, pointflight::kVersion)); });
}

int run(int argc, char** argv) {
  pointflight::add_gpu_renderer();
  using namespace pointflight::apps;  // NOLINT(google-build-using-namespace): this function only
  CLI::App app{"pointflight: a LiDAR drone in point-cloud maps of real places", "pointflight"};
  app.set_version_flag("--version", version_text);
  app.require_subcommand(1);
  int exit_code = kDone;
  add_map_command(app, exit_code);
  add_world_command(app, exit_code);
  add_scenario_command(app, exit_code);
  add_fly_command(app, exit_code);
  add_scan_command(app, exit_code);
  add_raycast_command(app, exit_code);
  add_lidar_command(app, exit_code);
  add_vehicle_command(app, exit_code);
  add_replay_command(app, exit_code);
  add_picture_command(app, exit_code);
  add_bag_command(app, exit_code);
  add_compare_command(app, exit_code);
  add_fidelity_command(app, exit_code);
  add_view_command(app, exit_code);
  add_study_command(app, exit_code);
  add_campaign_command(app, exit_code);
  add_gpu_command(app, exit_code);
  add_doctor_command(app, exit_code);
  add_self_test_command(app, exit_code);
  add_shell_commands(app);
  app.footer(  // not of the commands, which have examples of their own
      "A first tour: pointflight map forest -o forest.pcd\n"
      "              pointflight map import forest.pcd -o forest.pfmap\n"
      "              pointflight fly forest.pfmap -o run");
  const std::vector<std::string> words = command_words(argc, argv);
  try {
    // CLI11 takes them from the back
    app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    say(fmt::format("pointflight: {}\n", explain(error, app, words)));
    return kWrongInput;
  }
  return exit_code;
}

/// A swarm has some files open for each vehicle, more than shells allow at first.
void allow_many_files() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, 65536);
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

/// Throws InputError where deep calls would end in a crash without a word.
void require_stack() {
  constexpr rlim_t kLeast = 256 << 10;
  rlimit limit{};
  if (::getrlimit(RLIMIT_STACK, &limit) != 0 || limit.rlim_cur >= kLeast) return;
  throw pointflight::InputError(
      fmt::format("the stack is limited to {} KB; allow 8 MB, as is usual: ulimit -s 8192",
                  limit.rlim_cur / 1024));
}

/// Says that memory has run out, and what helps.
std::string memory_line(int argc, char** argv) {
  const std::string_view verb = argc > 1 ? argv[1] : "";
  const std::string_view first = verb == "map"        ? "give a coarser --resolution, or "
                                 : verb == "campaign" ? "give fewer --jobs, or "
                                                      : "";
  return fmt::format("pointflight: out of memory; {}raise the limit (ulimit -v, a container's){}\n",
                     first,
                     first.empty() ? " or close other programs" : "");
}

/// Runs the program; every error becomes a line and an exit code.
int guarded_run(int argc, char** argv) {
  // a full file-size limit or a closed pipe is an error of a write, not the end of the process
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  pointflight::survive_cut_files();
  allow_many_files();
  const std::string no_memory = memory_line(argc, argv);
  pointflight::apps::keep_memory_reserve(no_memory);
  using pointflight::apps::end_progress;
  using pointflight::apps::say;
  try {
    require_stack();
    const int code = run(argc, argv);
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
    say("pointflight: standard output: cannot write; is the disk full?\n");
  } catch (const pointflight::apps::Interrupted&) {
    end_progress();
    say("pointflight: interrupted\n");
    return pointflight::apps::kInterrupted;
  } catch (const pointflight::InputError& error) {
    end_progress();
    say(fmt::format("pointflight: {}\n", error.what()));
  } catch (const std::bad_alloc&) {
    pointflight::apps::release_memory_reserve();
    end_progress();
    say(no_memory);
  } catch (const std::exception& error) {
    end_progress();
    // TBB's words and the library's own
    const auto* system = dynamic_cast<const std::system_error*>(&error);
    const bool no_thread =
        std::string_view(error.what()).starts_with("pthread_create") ||
        (system != nullptr && system->code() == std::errc::resource_unavailable_try_again);
    say(no_thread ? "pointflight: the system allows no further thread; allow more (ulimit -u) or "
                    "more memory, or give --threads 1\n"
                  : fmt::format("pointflight: {}\n", error.what()));
  }
  return pointflight::apps::kWrongInput;
}

}  // namespace

int main(int argc, char** argv) {
  const int code = guarded_run(argc, argv);
  if (pointflight::apps::must_leave_static_objects()) std::_Exit(code);
  return code;
}
