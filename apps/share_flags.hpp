#pragma once

#include <CLI/App.hpp>
#include <memory>
#include <string>
#include <vector>

#include "pointflight/run/run_loop.hpp"
#include "share/share_link.hpp"

namespace pointflight::apps {

/// Flags of `fly` for a run that several processes share.
struct ShareFlags {
  std::string name;                   ///< Of the run; empty: not shared.
  std::vector<std::string> vehicles;  ///< "0-3", "7", "drone4"
  bool localhost = false;             ///< No other machine.

  [[nodiscard]] bool is_asked() const { return !name.empty(); }
};

void add_share_flags(CLI::App& app, ShareFlags& flags);

/// Throws InputError for what does not go together.
void check_share_flags(const ShareFlags& flags);

/// True where processes keep time by their wall clocks.
bool is_free(const ShareFlags& flags, const Scenario& scenario);

/// A process' part in a shared run, with all that it consists of.
class SharedRun {
 public:
  /// Joins: the simulation knows from then on which vehicles are its own. All must outlive it.
  /// Throws InputError.
  SharedRun(const ShareFlags& flags, Simulation& simulation, const RunLoop& loop, double rate);

  [[nodiscard]] Link& link() { return *link_; }
  [[nodiscard]] const FleetShare& fleet() const { return *share_; }
  /// Who flew what, how far apart clocks were, what was lost.
  void say() const;

 private:
  std::unique_ptr<ShareTransport> transport_;
  std::unique_ptr<FleetShare> share_;
  std::unique_ptr<ShareLink> link_;
};

}  // namespace pointflight::apps
