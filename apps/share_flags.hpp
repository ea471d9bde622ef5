#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "apps/cli.hpp"
#include "apps/flight_part.hpp"
#include "pointflight/run/run_loop.hpp"
#include "pointflight/share/share_link.hpp"

namespace pointflight::apps {

/// Flags of `fly` for a run that several processes share.
struct ShareFlags {
  std::string name;                   ///< Of the run; empty: not shared.
  std::vector<std::string> vehicles;  ///< "0-3", "7", "drone4"
  bool localhost = false;             ///< No other machine.

  [[nodiscard]] bool is_asked() const { return !name.empty(); }
};

void add_share_flags(CLI::App& app, ShareFlags& flags);

/// A process' part in a shared run, with all that it consists of.
class SharePart : public FlightPart {
 public:
  /// The run's results are written to `folder`, if it is not empty.
  SharePart(ShareFlags flags, std::string folder)
      : flags_(std::move(flags)), folder_(std::move(folder)) {}
  void check() const override;
  /// True if processes keep time by their wall clocks.
  [[nodiscard]] bool is_live(const Scenario& scenario) const override;
  void prepare(Scenario& scenario, double rate) override;
  /// Joins: the simulation knows from then on which vehicles it flies.
  void connect(Simulation& simulation, RunLoop& loop) override;
  /// Who flew what, how far apart clocks were, what was lost.
  void report(const RunLoop& loop) const override;
  /// The run was ended for all by a fault (`FleetShare::fault`).
  [[nodiscard]] bool has_failed() const override;

 private:
  void join(Simulation& simulation, const RunLoop& loop);
  void resume(Simulation& simulation) const;

  ShareFlags flags_;
  std::string folder_;
  double rate_ = 0.0;  ///< Simulated seconds per second.
  std::unique_ptr<ShareTransport> transport_;
  std::unique_ptr<FleetShare> share_;
  std::unique_ptr<ShareLink> link_;
};

}  // namespace pointflight::apps
