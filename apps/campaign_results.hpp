#pragma once

#include <vector>

#include "apps/campaign_report.hpp"
#include "pointflight/campaign/campaign.hpp"
#include "pointflight/campaign/statistics.hpp"

namespace pointflight::apps {

/// All records, for rates of all.
std::vector<const RunRecord*> all_of(const Results& results);

/// Those that failed, with their logs and how to fly them again.
std::vector<FailedRun> failed_of(const Campaign& campaign, const Results& results);

/// Tables, plots and the report into the campaign's folder. Throws InputError.
void write_results(const Campaign& campaign,
                   const Results& results,
                   const std::vector<FailedRun>& failed);

/// Rates and failures on stdout.
void print_results(const Campaign& campaign,
                   const Results& results,
                   const std::vector<FailedRun>& failed,
                   bool json);

}  // namespace pointflight::apps
