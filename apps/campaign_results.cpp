#include "apps/campaign_results.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "apps/campaign_report.hpp"
#include "apps/settings_json.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/output_file.hpp"

namespace pointflight::apps {
namespace {

namespace fs = std::filesystem;

void write_file(const Campaign& campaign, const std::string& name, const std::string& text) {
  OutputFile file((fs::path(campaign.folder()) / name).string());
  file.write(text);
  file.commit();
}

/// "plot_mission_speed": a key as a file's name.
std::string plot_name(const std::string& key) {
  std::string name = "plot_";
  for (const char c : key) {
    const bool is_plain =
        (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (is_plain || c == '_') {
      name += c;
    } else if (name.back() != '_') {
      name += '_';
    }
  }
  while (name.back() == '_') name.pop_back();
  return name;
}

nlohmann::ordered_json json_of(const Rate& rate) {
  return {{"count", rate.count},
          {"of", rate.of},
          {"rate", rate.value},
          {"low", rate.low},
          {"high", rate.high}};
}

}  // namespace

std::vector<const RunRecord*> all_of(const Results& results) {
  std::vector<const RunRecord*> all;
  for (const auto& [number, run] : results) all.push_back(&run);
  return all;
}

std::vector<FailedRun> failed_of(const Campaign& campaign, const Results& results) {
  std::vector<FailedRun> failed;
  for (const auto& [number, run] : results) {
    if (run.status != RunStatus::kFailed) continue;
    failed.push_back({number,
                      run.reason,
                      campaign.run_folder(number) + "/log.txt",
                      campaign.repeating_command(number)});
  }
  return failed;
}

void write_results(const Campaign& campaign,
                   const Results& results,
                   const std::vector<FailedRun>& failed) {
  write_file(campaign, "runs.csv", runs_csv(campaign.plan(), results));
  write_file(campaign, "runs_timing.csv", timing_csv(results));
  write_file(campaign, "points.csv", points_csv(campaign.plan(), results));
  const auto plots = campaign_plots(campaign.plan(), results);
  for (const CampaignPlot& plot : plots) {
    const std::string name = plot_name(plot.key);
    plot.canvas->save((fs::path(campaign.folder()) / (name + ".png")).string());
    write_file(campaign, name + ".svg", plot.canvas->svg());
  }
  write_file(campaign, "report.html", campaign_html(campaign, results, plots, failed));
}

void print_results(const Campaign& campaign,
                   const Results& results,
                   const std::vector<FailedRun>& failed,
                   bool json) {
  const auto all = all_of(results);
  if (json) {
    nlohmann::ordered_json value;
    value["folder"] = campaign.folder();
    value["flights"] = campaign.plan().runs.size();
    value["done"] = results.size();
    for (const Counted counted : {Counted::kCompleted, Counted::kCollision, Counted::kFailed}) {
      value[std::string(name_of(counted))] = json_of(rate_of(all, counted));
    }
    print_json(value);
    return;
  }
  const auto say_rate = [&](const char* name, Counted counted) {
    const Rate rate = rate_of(all, counted);
    if (rate.of == 0) return;
    fmt::print("  {:<17} {} of {}: {:.1f} % (95 %: {:.1f} to {:.1f})\n",
               name,
               rate.count,
               rate.of,
               100.0 * rate.value,
               100.0 * rate.low,
               100.0 * rate.high);
  };
  fmt::print("{} of {} flights\n", results.size(), campaign.plan().runs.size());
  say_rate("completed", Counted::kCompleted);
  say_rate("with a collision", Counted::kCollision);
  say_rate("failed", Counted::kFailed);
  constexpr std::size_t kMost = 5;
  for (std::size_t i = 0; i < std::min(kMost, failed.size()); ++i) {
    fmt::print("  flight {} failed: {}; log: {}\n    again: {}\n",
               failed[i].number,
               printable(failed[i].reason),
               failed[i].log,
               failed[i].command);
  }
  if (failed.size() > kMost) fmt::print("  {} more failed: report.html\n", failed.size() - kMost);
  fmt::print("  results           {}/report.html\n", campaign.folder());
}

}  // namespace pointflight::apps
