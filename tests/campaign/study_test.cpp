// Studies as files, the flights that they mean, and scenarios with other values.
#include "pointflight/campaign/study.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "pointflight/campaign/plan.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;

TEST(Study, IsReadWithAllItsKeys) {
  const Study study = parse_study(R"(scenario: forest.yaml
seeds: {from: 3, to: 5}
grid:
  mission.speed: [1, 2.5]
  obstacles[0].count: {from: 0, to: 100, n: 6}
  vehicle.start: [[0, 0, 1], [1, 2, 3]]
draws:
  count: 2
  seed: 9
  air.wind.mean: {uniform: [0, 5]}
command: [./planner, --scenario, "{scenario}", -o, "{output}"]
limits: {time: 60, memory: 2e9}
figures: figures.json
keep: all
)",
                                  "s.yaml");
  EXPECT_EQ(study.scenario, "forest.yaml");
  EXPECT_EQ(study.seeds, (std::vector<std::int64_t>{3, 4, 5}));
  ASSERT_EQ(study.grid.size(), 3u);
  EXPECT_EQ(study.grid[0].values, (std::vector<std::string>{"1", "2.5"}));
  EXPECT_EQ(study.grid[1].values, (std::vector<std::string>{"0", "20", "40", "60", "80", "100"}));
  EXPECT_EQ(study.grid[2].values, (std::vector<std::string>{"[0, 0, 1]", "[1, 2, 3]"}));
  EXPECT_EQ(study.grid[1].line, 5);
  EXPECT_EQ(study.draw_count, 2u);
  EXPECT_EQ(study.time_limit, 60.0);
  EXPECT_EQ(study.memory_limit, 2e9);
  EXPECT_EQ(study.kept, KeptFiles::kAll);
  const Plan plan = plan_of(study);
  EXPECT_EQ(plan.runs.size(), 2u * 6 * 2 * 2 * 3);
  EXPECT_EQ(plan.point_values.size(), 24u);
  EXPECT_EQ(plan.grid_keys, 3u);
  EXPECT_EQ(plan.keys.back(), "air.wind.mean");
}

TEST(Study, MistakesAreSaidWithTheirLine) {
  const auto error = [](const std::string& text) {
    return error_of([&] { parse_study(text, "s.yaml"); });
  };
  expect_contains(error("seeds: 3\n"), "scenario: missing; add it");
  expect_contains(error("scenario: a\nseed: 3\n"),
                  "s.yaml:2: seed: unknown key; did you mean 'seeds'?");
  expect_contains(error("scenario: a\nseeds: [1, 1]\n"),
                  "s.yaml:2: seeds: one of them is given twice");
  expect_contains(error("scenario: a\nlimits: {memory: 1}\n"),
                  "s.yaml:2: limits.memory: is in bytes");
  expect_contains(error("scenario: a\nseeds: []\n"), "s.yaml:2: seeds: the list is empty");
  expect_contains(error("scenario: a\nseeds: {from: 3}\n"), "give `to` as well");
  expect_contains(error("scenario: a\nseeds: {values: [3], to: 5}\n"), "not both");
  expect_contains(error("scenario: a\nseeds: {from: 3, to: 1}\n"), "from 3 to 1 are none");
  expect_contains(error("scenario: a\nseeds: 1.5\n"), "whole number");
  expect_contains(error("scenario: a\nseeds: [1.5]\n"), "whole number");
  expect_contains(error("scenario: a\ngrid:\n  x: {from: 0, to: 1}\n"),
                  "s.yaml:3: grid.x: give `from`, `to` and `n`");
  expect_contains(error("scenario: a\ngrid:\n  x: {n: 3}\n"), "give `from`, `to` and `n`");
  expect_contains(error("scenario: a\ngrid:\n  x: {values: [1], n: 3}\n"), "not both");
  expect_contains(error("scenario: a\ngrid:\n  x: {from: 0, to: 1, m: 3}\n"),
                  "s.yaml:3: grid.x.m: unknown key");
  expect_contains(error("scenario: a\ngrid:\n  x: []\n"), "grid.x: has no values");
  expect_contains(error("scenario: a\ngrid:\n  x:\n"), "grid.x: has no values");
  expect_contains(error("scenario: a\ngrid:\n  x: 3\n"), "s.yaml:3: grid.x: expected a list or");
  expect_contains(error("scenario: a\ngrid:\n  x: [1]\n  x: [2]\n"),
                  "s.yaml:4: grid.x: this key stands twice");
  expect_contains(error("scenario: a\ngrid: {seed: [1]}\n"), "is given by `seeds`");
  expect_contains(error("scenario: a\ngrid: {x: [1]}\ndraws: {count: 1, x: {choice: [1]}}\n"),
                  "s.yaml:3: draws.x: is in `grid` as well");
  expect_contains(error("scenario: a\ndraws: {count: 2}\n"), "names no key");
  expect_contains(error("scenario: a\ndraws: {x: {uniform: [0, 1]}}\n"), "draws.count: missing");
  expect_contains(error("scenario: a\ndraws: {count: 1, x: {uniform: [2, 1]}}\n"),
                  "draws.x.uniform: give two numbers, the smaller one first");
  expect_contains(error("scenario: a\ndraws: {count: 1, x: {log_uniform: [0, 1]}}\n"), "above 0");
  expect_contains(error("scenario: a\ndraws: {count: 1, x: {}}\n"), "draws.x: give one way");
  expect_contains(error("scenario: a\ndraws: {count: 1, x: {choice: [1], integer: [1, 2]}}\n"),
                  "draws.x: give one way");
  expect_contains(error("scenario: a\ncommand: [planner]\n"), "{scenario}");
  expect_contains(error("scenario: a\ncommand: [[planner]]\n"), "plain text");
  expect_contains(error("scenario: a\nkeep: some\n"), "one of: results, all");
  expect_contains(error("scenario: [a\n"), "s.yaml:");
  expect_contains(error("- a\n"), "s.yaml: expected");
  Study many;
  many.seeds.resize(1000);
  many.grid = {{"a", std::vector<std::string>(1000, "1"), 1}, {"b", {100, "1"}, 2}};
  expect_contains(error_of([&] { plan_of(many); }), "1e+08 flights");
}

TEST(Study, WhatFliesByACommandIsKeptUnlessTheFileSaysSo) {
  const std::string start = "scenario: a\ncommand: [p, \"{scenario}\"]\n";
  EXPECT_EQ(parse_study(start, "s.yaml").kept, KeptFiles::kAll);
  EXPECT_EQ(parse_study(start + "keep: results\n", "s.yaml").kept, KeptFiles::kResults);
  EXPECT_EQ(parse_study("scenario: a\n", "s.yaml").kept, KeptFiles::kResults);
}

TEST(Study, TheTemplateIsAStudyOfTenSeeds) {
  const Study study = parse_study(study_template("here/forest 1.yaml"), "s.yaml");
  EXPECT_EQ(study.scenario, "here/forest 1.yaml");
  EXPECT_EQ(study.seeds.size(), 10u);
  EXPECT_TRUE(study.grid.empty());
  EXPECT_TRUE(study.draws.empty());
  EXPECT_TRUE(study.command.empty());
  EXPECT_EQ(study.kept, KeptFiles::kResults);
}

TEST(Study, TheTableHasKeysOfGridAndDraws) {
  const std::string table = study_reference();
  for (const char* row : {"| `scenario` |  | **required**",
                          "| `seeds.from`",
                          "| `grid.KEY.n`",
                          "| `draws.KEY.log_uniform`",
                          "| `limits.memory` | bytes"}) {
    expect_contains(table, row);
  }
}

TEST(Plan, GoesThroughSeedsThenDrawsThenTheLastAxis) {
  Study study;
  study.seeds = {7, 8};
  study.grid = {{"a", {"1", "2"}, 0}, {"b", {"x", "y"}, 0}};
  const Plan plan = plan_of(study);
  ASSERT_EQ(plan.runs.size(), 8u);
  EXPECT_EQ(plan.runs[0].seed, 7);
  EXPECT_EQ(plan.runs[1].seed, 8);
  EXPECT_EQ(plan.runs[2].values, (std::vector<std::string>{"1", "y"}));
  EXPECT_EQ(plan.runs[5].values, (std::vector<std::string>{"2", "x"}));
  EXPECT_EQ(plan.runs[5].point, 2u);
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(plan.runs[i].number, i);
}

TEST(Plan, DrawsAreOfTheirDistributionAndTheSameAtEachPoint) {
  Study study;
  study.seeds = {1};
  study.grid = {{"a", {"1", "2"}, 0}};
  study.draw_count = 4000;
  StudyDraw uniform{"u", 2.0, 6.0, false, false, {}, 0};
  StudyDraw logarithmic{"l", 0.01, 100.0, true, false, {}, 0};
  StudyDraw whole{"w", 1.0, 3.0, false, true, {}, 0};
  StudyDraw choice{"c", 0.0, 0.0, false, false, {"p", "q"}, 0};
  study.draws = {uniform, logarithmic, whole, choice};
  const Plan plan = plan_of(study);
  ASSERT_EQ(plan.runs.size(), 8000u);
  double sum = 0.0;
  double logs = 0.0;
  int twos = 0;
  int ps = 0;
  for (std::size_t i = 0; i < 4000; ++i) {
    const PlannedRun& run = plan.runs[i];
    const double u = std::stod(run.values[1]);
    const double l = std::stod(run.values[2]);
    EXPECT_TRUE(u >= 2.0 && u <= 6.0 && l >= 0.01 && l <= 100.0);
    sum += u;
    logs += std::log10(l);
    twos += run.values[3] == "2" ? 1 : 0;
    ps += run.values[4] == "p" ? 1 : 0;
    for (std::size_t k = 1; k < 5; ++k) EXPECT_EQ(run.values[k], plan.runs[i + 4000].values[k]);
  }
  // within four deviations
  EXPECT_NEAR(sum / 4000, 4.0, 4.0 * 4.0 / std::sqrt(12.0 * 4000));
  EXPECT_NEAR(logs / 4000, 0.0, 4.0 * 4.0 / std::sqrt(12.0 * 4000));
  EXPECT_NEAR(twos, 4000.0 / 3.0, 4.0 * std::sqrt(4000.0 * 2.0 / 9.0));
  EXPECT_NEAR(ps, 2000.0, 4.0 * std::sqrt(1000.0));
}

TEST(EditedScenario, HasOtherValuesAndKeepsTheRest) {
  const std::string text = "map: m.pfmap\nmission:\n  speed: 2\nobstacles:\n  - {count: 3}\n";
  const std::string edited =
      edited_scenario(text,
                      {"mission.speed", "obstacles[0].count", "air.wind.mean", "vehicle.start"},
                      {"4", "7", "[1, 0, 0]", "[0, 0, 2]"});
  expect_contains(edited, "map: m.pfmap");
  expect_contains(edited, "speed: 4");
  expect_contains(edited, "count: 7");
  expect_contains(edited, "mean: [1, 0, 0]");
  expect_contains(edited, "start: [0, 0, 2]");
  const auto error = [&](const std::string& key) {
    return error_of([&] { edited_scenario(text, {key}, {"1"}); });
  };
  expect_contains(error("obstacles[1].count"), "the scenario has 1 of these");
  expect_contains(error("lidars[0].model"), "the scenario has 0 of these");
  expect_contains(error("map.x"), "has no keys");
  for (const char* key : {"", ".", "a.", "a..b", "[0]", "a[", "a[x]", "a[-1]", "a[0]b", "a[1.5]"}) {
    EXPECT_NE(error(key), "") << key;
  }
}

}  // namespace
}  // namespace pointflight
