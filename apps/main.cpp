#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <csignal>
#include <exception>
#include <new>

#include "apps/commands.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/version.hpp"

namespace {

int run(int argc, char** argv) {
  using namespace pointflight::apps;  // NOLINT(google-build-using-namespace): this function only
  CLI::App app{"pointflight: a LiDAR drone in point-cloud maps of real places", "pointflight"};
  app.set_version_flag("--version", std::string("pointflight ") + pointflight::kVersion);
  app.require_subcommand(1);
  app.footer(
      "A first tour: pointflight map forest -o forest.pcd\n"
      "              pointflight map import forest.pcd -o forest.pfmap\n"
      "              pointflight fly forest.pfmap -o run");
  int exit_code = kDone;
  add_map_command(app, exit_code);
  add_scenario_command(app, exit_code);
  add_fly_command(app, exit_code);
  add_scan_command(app, exit_code);
  add_lidar_command(app, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    fmt::print(stderr, "pointflight: {}; see pointflight --help\n", error.what());
    return kWrongInput;
  }
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  // a full file-size limit or a closed pipe is an error of a write, not the end of the process
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  try {
    return run(argc, argv);
  } catch (const pointflight::InputError& error) {
    fmt::print(stderr, "pointflight: {}\n", error.what());
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "pointflight: out of memory; give a coarser --resolution\n");
  } catch (const std::exception& error) {
    fmt::print(stderr, "pointflight: {}\n", error.what());
  }
  return pointflight::apps::kWrongInput;
}
