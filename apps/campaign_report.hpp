#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "pointflight/campaign/campaign.hpp"
#include "pointflight/campaign/statistics.hpp"
#include "pointflight/picture/canvas.hpp"

namespace pointflight::apps {

/// Rates with their intervals and the closest approach over an axis of the grid whose values are
/// numbers, a line for each combination of the other axes (eight at most).
struct CampaignPlot {
  std::string key;                          ///< Of the axis.
  std::unique_ptr<picture::Canvas> canvas;  ///< Keeps strokes.
};
std::vector<CampaignPlot> campaign_plots(const Plan& plan, const Results& results);

/// A run that failed, with what a reader wants to do about it.
struct FailedRun {
  std::size_t number;
  std::string reason, log, command;
};

/// One page without scripts and without anything from elsewhere: what was flown, rates of each
/// point, plots, failures.
std::string campaign_html(const Campaign& campaign,
                          const Results& results,
                          const std::vector<CampaignPlot>& plots,
                          const std::vector<FailedRun>& failed);

}  // namespace pointflight::apps
