#include "apps/sitl_process.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <system_error>
#include <utility>

#include "apps/terminal.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/sitl/px4_parameters.hpp"

namespace pointflight::apps {
namespace {

namespace fs = std::filesystem;

/// The program in a build, or the program itself.
fs::path program_of(const std::string& given) {
  std::error_code error;
  const fs::path path = fs::absolute(given, error);
  const fs::path program = fs::is_directory(path, error) ? path / "bin" / "px4" : path;
  if (!fs::is_regular_file(program, error)) {
    throw InputError(
        fmt::format("--px4-start: {}: there is no such program; give bin/px4 of a build for SITL, "
                    "or the build's "
                    "folder (build/px4_sitl_default)",
                    program.string()));
  }
  return program;
}

}  // namespace

StartedPx4::StartedPx4(const std::string& program,
                       const std::string& folder,
                       std::uint16_t instance,
                       const VehicleSettings& vehicle,
                       bool vision) {
  const fs::path px4 = program_of(program);
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw InputError(fmt::format("{}: {}", folder, error.message()));
  ProcessRequest request;
  request.folder = folder;
  request.log = (fs::path(folder) / "console.txt").string();
  // the airframe for simulators that are none of PX4's own; parameters by the environment are
  // taken by 1.17 and later
  request.command = {"env", "PX4_SYS_AUTOSTART=10016", "PX4_SIM_MODEL=none_iris"};
  for (const Px4Parameter& p : px4_parameters(vehicle, vision)) {
    request.command.push_back(p.is_integer ? fmt::format("PX4_PARAM_{}={:.0f}", p.name, p.value)
                                           : fmt::format("PX4_PARAM_{}={:.7g}", p.name, p.value));
  }
  request.command.push_back(px4.string());
  request.command.insert(request.command.end(), {"-i", std::to_string(instance), "-d"});
  const fs::path etc = px4.parent_path().parent_path() / "etc";
  if (fs::is_directory(etc, error)) request.command.push_back(etc.string());
  log(fmt::format("starting PX4, instance {}; its console: {}", instance, request.log));
  thread_ = std::thread([this, request = std::move(request)] {
    try {
      const ProcessResult result = run_process(request, stop_);
      if (!stop_) {
        log(fmt::format("PX4 has ended ({}); its console: {}",
                        result.signal != 0 ? fmt::format("signal {}", result.signal)
                                           : fmt::format("exit code {}", result.exit_code),
                        request.log));
      }
    } catch (const InputError& failure) {
      log(failure.what());
    }
    gone_ = true;
  });
}

StartedPx4::~StartedPx4() {
  stop_ = true;
  thread_.join();
}

}  // namespace pointflight::apps
