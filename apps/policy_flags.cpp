#include "apps/policy_flags.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "apps/terminal.hpp"
#include "pointflight/core/input_error.hpp"

namespace pointflight::apps {

void add_policy_flag(CLI::App& app, std::string& policy) {
  app.add_option(
      "--policy",
      policy,
      "A policy (.npz of pointflight.gym) flies the vehicles to their waypoints, by odometry "
      "and the first LiDAR");
}

void PolicyPart::prepare(Scenario& scenario, double /*rate*/) {
  if (path_.empty()) return;
  policy_ = std::make_shared<const Policy>(Policy::load(path_));
  scenario.vehicles = scenario.fleet();  // each with goals of its own
  scenario.is_short = scenario.vehicles.size() == 1;
  for (VehicleSetup& vehicle : scenario.vehicles) {
    if (vehicle.autopilot.kind != AutopilotKind::kOwn) {
      throw InputError(fmt::format(
          "--policy: a firmware flies {} (autopilot); it and a policy would both command it",
          vehicle.name));
    }
    std::vector<Vector3d> goals = std::exchange(vehicle.mission.waypoints, {});
    if (policy_->settings().task == "hover") goals = {vehicle.start};
    if (goals.empty()) {
      throw InputError(fmt::format(
          "--policy: {} has no waypoints to fly to; give them with --mission or in the scenario",
          vehicle.name));
    }
    vehicle.commands.clear();
    names_.push_back(vehicle.name);
    goals_.push_back(std::move(goals));
  }
  scenario.output.odometry_rate = std::max(scenario.output.odometry_rate, 100.0);
}

void PolicyPart::connect(Simulation& /*simulation*/, RunLoop& loop) {
  for (std::size_t i = 0; i < goals_.size(); ++i) {
    pilots_.push_back(std::make_unique<PolicyPilot>(policy_, i, goals_[i]));
    loop.add(*pilots_.back());
  }
}

void PolicyPart::report(const RunLoop& /*loop*/) const {
  if (!policy_ || policy_->settings().task == "hover") return;
  for (std::size_t i = 0; i < pilots_.size(); ++i) {
    log(fmt::format(
        "policy: {} reached {} of {} goals", names_[i], pilots_[i]->reached(), goals_[i].size()));
  }
}

}  // namespace pointflight::apps
