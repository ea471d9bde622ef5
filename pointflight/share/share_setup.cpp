#include "pointflight/share/share_setup.hpp"

namespace pointflight {
namespace {

constexpr Named<ShareTime> kTimes[] = {{ShareTime::kFree, "free"},
                                       {ShareTime::kLockstep, "lockstep"}};
constexpr Named<OnLoss> kLosses[] = {{OnLoss::kVanish, "vanish"}, {OnLoss::kHold, "hold"}};
constexpr Named<OnReturn> kReturns[] = {{OnReturn::kStart, "start"}, {OnReturn::kLog, "log"}};

ScenarioSection share_section() {
  return {.name = "share",
          .help = "a run that several processes fly together, for --share (docs/swarms.md)",
          .settings = ShareSetup{},
          .example = ShareSetup{},
          .describe = [](SettingsVisitor& v,
                         std::any& settings) { describe(v, std::any_cast<ShareSetup&>(settings)); },
          .models = [](std::any&) { return std::vector<std::string*>{}; }};
}

// scenarios have it in every program that can share a run
[[maybe_unused]] const ScenarioSection& kShareSection = scenario_sections().add(share_section());

}  // namespace

void describe(SettingsVisitor& v, ShareSetup& s) {
  v.choice({"time", "", "free: each by its wall clock; lockstep: the bytes of one process"},
           s.time,
           kTimes);
  v.only_if(s.time == ShareTime::kFree, "time: free", [&](SettingsVisitor& w) {
    w.value({"rate", "Hz", "of the states that vehicles of other processes get", 1, 1000}, s.rate);
  });
  v.only_if(s.time == ShareTime::kLockstep, "time: lockstep", [&](SettingsVisitor& w) {
    w.value(
        {"ahead", "", "steps that no process waits for; 0: the same bytes as one process", 0, 1000},
        s.ahead);
  });
  v.value({"lease", "s", "a process that is silent for so long is lost", 0.1, 3600}, s.lease);
  v.choice({"on_loss", "", "bodies of a lost process vanish, or hold where they were"},
           s.on_loss,
           kLosses);
  v.choice({"on_return",
            "",
            "a process that is started again begins at the start, or where its log ends"},
           s.on_return,
           kReturns);
}

const ShareSetup& share_setup_of(const Scenario& scenario) {
  static const ShareSetup defaults;
  const auto found = scenario.sections.find("share");
  return found == scenario.sections.end() ? defaults
                                          : std::any_cast<const ShareSetup&>(found->second);
}

}  // namespace pointflight
