#pragma once

#include <memory>
#include <string>
#include <vector>

#include "apps/cli.hpp"
#include "apps/flight_part.hpp"
#include "apps/sitl_process.hpp"
#include "pointflight/sitl/ardupilot_link.hpp"
#include "pointflight/sitl/px4_link.hpp"

namespace pointflight::apps {

/// Who flies the vehicles, instead of what the scenario says.
struct SitlFlags {
  bool px4 = false;
  bool ardupilot = false;
  std::string start;                  ///< PX4's program, to be started; empty: somebody does.
  std::string address = "127.0.0.1";  ///< That firmwares are listened for at.
};

/// Adds `--px4`, `--ardupilot` and what belongs to it.
void add_sitl_flags(CLI::App& app, SitlFlags& flags);

/// Firmwares that fly vehicles: those of the scenario (`autopilot: px4`), or all by a flag.
class SitlPart : public FlightPart {
 public:
  /// `output`: the flight's folder; firmwares that are started get folders beside it.
  SitlPart(SitlFlags flags, std::string output)
      : flags_(std::move(flags)), output_(std::move(output)) {}

  void check() const override;
  [[nodiscard]] bool is_live(const Scenario& scenario) const override;
  void prepare(Scenario& scenario, double rate) override;
  void place(Scenario& scenario, const std::shared_ptr<const SurfelMap>& map) const override;
  [[nodiscard]] double lockstep() const override { return lockstep_; }
  void connect(Simulation& simulation, RunLoop& loop) override;
  void report(const RunLoop& loop) const override;
  [[nodiscard]] bool has_failed() const override;

 private:
  [[nodiscard]] AutopilotKind kind_of(const VehicleSetup& vehicle) const;
  [[nodiscard]] bool is_flown(const VehicleSetup& vehicle) const {
    return kind_of(vehicle) != AutopilotKind::kOwn;
  }
  void add_px4(std::size_t number, Simulation& simulation, RunLoop& loop);
  void add_ardupilot(std::size_t number, Simulation& simulation, RunLoop& loop);

  SitlFlags flags_;
  std::string output_;
  std::vector<std::unique_ptr<StartedPx4>> started_;
  double lockstep_ = 0.0;
  std::vector<std::string> px4_names_;  ///< Of the vehicles of `px4_`.
  std::vector<std::unique_ptr<Px4Link>> px4_;
  std::vector<std::string> ardupilot_names_;
  std::vector<std::unique_ptr<ArduPilotLink>> ardupilot_;
};

}  // namespace pointflight::apps
