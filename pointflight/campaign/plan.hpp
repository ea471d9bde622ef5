// What a study flies: values of a scenario's keys, flight by flight.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "pointflight/campaign/study.hpp"

namespace pointflight {

/// One flight of a study.
struct PlannedRun {
  std::size_t number = 0;           ///< From 0, in the plan.
  std::size_t point = 0;            ///< Of the grid.
  std::int64_t seed = 0;            ///< Of the scenario.
  std::vector<std::string> values;  ///< By `Plan::keys`.
};

/// All flights of a study: for each point of the grid (the last axis fastest) each draw with each
/// seed. The same study gives the same plan.
struct Plan {
  std::vector<std::string> keys;                       ///< Of the grid, then of the draws.
  std::size_t grid_keys = 0;                           ///< So many of them are the grid's.
  std::vector<std::vector<std::string>> point_values;  ///< By point, of the grid's keys.
  std::vector<PlannedRun> runs;                        ///< By number.
};

/// Throws InputError if there would be more than ten million flights.
Plan plan_of(const Study& study);

/// The extreme values of a draw, or all of its choices.
std::vector<std::string> extremes_of(const StudyDraw& draw);

/// A scenario's text with other values of some keys. Where a key's sections are missing they are
/// made; an entry of a list has to be there. Throws InputError that names the key.
std::string edited_scenario(std::string_view yaml,
                            const std::vector<std::string>& keys,
                            const std::vector<std::string>& values);

}  // namespace pointflight
