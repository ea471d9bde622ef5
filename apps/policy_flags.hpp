#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "apps/flight_part.hpp"
#include "pointflight/learn/policy_pilot.hpp"

namespace pointflight::apps {

/// Adds `--policy`.
void add_policy_flag(CLI::App& app, std::string& policy);

/// A policy that flies all vehicles to the waypoints of their missions, instead of these.
class PolicyPart : public FlightPart {
 public:
  /// Of a .npz; empty: nothing is flown.
  explicit PolicyPart(std::string path) : path_(std::move(path)) {}

  void prepare(Scenario& scenario, double rate) override;
  void connect(Simulation& simulation, RunLoop& loop) override;
  void report(const RunLoop& loop) const override;

 private:
  std::string path_;
  std::shared_ptr<const Policy> policy_;
  std::vector<std::string> names_;
  std::vector<std::vector<Vector3d>> goals_;  ///< Of each vehicle.
  std::vector<std::unique_ptr<PolicyPilot>> pilots_;
};

}  // namespace pointflight::apps
