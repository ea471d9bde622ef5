#include "apps/fly_links.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "apps/run_cost.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/number_text.hpp"
#include "pointflight/core/output_file.hpp"
#include "pointflight/core/resources.hpp"
#include "pointflight/picture/pictures.hpp"

namespace pointflight::apps {
namespace {

namespace fs = std::filesystem;
constexpr int kSaid = 20;

}  // namespace

void TerminalLink::on_sample(const Sample& sample) {
  if (const auto* event = std::get_if<CollisionEvent>(&sample)) say(*event);
  if (const auto* event = std::get_if<VehicleEvent>(&sample)) say(*event);
}

void TerminalLink::say(const CollisionEvent& event) {
  if (!event.entered || collisions_ > kSaid) return;
  log(collisions_++ == kSaid
          ? std::string("more collisions: see events.csv")
          : fmt::format("warning: collision at {:.3f} s, {} at {}, with {} at {}",
                        to_seconds(event.time),
                        simulation_.vehicle(event.vehicle).setup().name,
                        point_text(event.vehicle_world),
                        label_name(simulation_, event.partner),
                        point_text(event.position_world)));
}

void TerminalLink::say(const VehicleEvent& event) {
  if (events_ > kSaid) return;
  log(events_++ == kSaid
          ? std::string("more on board: see events.csv")
          : fmt::format("{}{} at {:.3f} s: {}",
                        event.kind == "back" || event.kind == "left" ? "" : "warning: ",
                        simulation_.vehicle(event.vehicle).setup().name,
                        to_seconds(event.time),
                        event.words));
}

void TerminalPart::connect(Simulation& simulation, RunLoop& loop) {
  link_ = std::make_unique<TerminalLink>(simulation);
  loop.add(*link_);
}

FolderLink::FolderLink(const FolderOptions& options,
                       const Simulation& simulation,
                       const RunLoop& loop,
                       int threads)
    : simulation_(simulation),
      loop_(loop),
      threads_(threads),
      draws_(options.draws),
      recorder_(options.folder, simulation, options.existing) {
  // whether their names are free is said before the flight
  if (draws_) picture_path_ = recorder_.path_for("overview.png");
  timing_path_ = recorder_.path_for("timing.json");
}

void FolderLink::on_sample(const Sample& sample) {
  if (ended_) return;
  recorder_.on_sample(sample);
  if (draws_) picture_.on_sample(sample);
}

void FolderLink::on_reset(SimTime /*reached*/) {
  close();
}

void FolderLink::close() {
  if (ended_) return;
  ended_ = true;
  if (draws_) {
    picture::describe_run(simulation_, picture_);
    picture::draw_overview(simulation_.map(), picture_, picture_path_);
  }
  write_timing();
  recorder_.finish(simulation_);
}

/// The one file that knows of clocks and of this machine's folders.
void FolderLink::write_timing() const {
  const Scenario& scenario = simulation_.scenario();
  nlohmann::ordered_json json;
  json["wall_time"] = loop_.wall_time();
  const RunCost cost = cost_of(simulation_, loop_);
  json["real_time_factor"] = cost.real_time_factor;
  json["cost"] = json_of(cost);
  json["threads"] = threads_;
  json["map"] = scenario.world
                    ? scenario.map_name()
                    : fs::weakly_canonical(resolve_path(scenario.map, scenario.folder())).string();
  json["command_line"] = command_line();
  OutputFile file(timing_path_);
  file.write(json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
  file.commit();
}

void FolderPart::check() const {
  const std::string& folder = options_.folder;
  if (folder.empty()) return;
  std::error_code error;
  if (fs::exists(folder, error) && !fs::is_directory(folder, error)) {
    throw InputError(fmt::format("{}: is a file; give a folder with -o", folder));
  }
  if (options_.existing == Existing::kRefuse && fs::is_directory(folder, error) &&
      !fs::is_empty(folder, error)) {
    throw InputError(
        fmt::format("{}: is not empty; choose another folder or give --force", folder));
  }
}

void FolderPart::connect(Simulation& simulation, RunLoop& loop) {
  if (options_.folder.empty()) return;
  link_ = std::make_unique<FolderLink>(options_, simulation, loop, threads_);
  loop.add(thread_.emplace(*link_, ThreadedLink::Options{.hold = kFilesWait}));
}

}  // namespace pointflight::apps
