// Intervals against published values, tables, conditions.
#include "pointflight/campaign/statistics.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;
using testing::TemporaryFolder;

RunRecord record(RunStatus status, std::int64_t collisions, double closest) {
  RunRecord r;
  r.status = status;
  r.collisions = collisions;
  r.closest_approach = closest;
  return r;
}

TEST(Wilson, GivesPublishedIntervals) {
  // Newcombe 1998, table I, method 3 (score without continuity correction)
  struct Row {
    std::size_t count, of;
    double low, high;
  };
  for (const Row& row : {Row{81, 263, 0.2553, 0.3662},
                         Row{15, 148, 0.0624, 0.1605},
                         Row{0, 20, 0.0, 0.1611},
                         Row{1, 29, 0.0061, 0.1718}}) {
    const Rate rate = wilson(row.count, row.of);
    EXPECT_NEAR(rate.low, row.low, 5e-5);
    EXPECT_NEAR(rate.high, row.high, 5e-5);
    const Rate other = wilson(row.of - row.count, row.of);
    EXPECT_NEAR(other.low, 1.0 - rate.high, 1e-12);
  }
  EXPECT_EQ(wilson(0, 0).high, 1.0);
  EXPECT_EQ(wilson(5, 5).high, 1.0);
}

TEST(Wilson, HoldsTheTruthAsOftenAsItSays) {
  // exact coverage over the binomial distribution: 95 % on average over p
  const std::size_t n = 40;
  double coverage = 0.0;
  int count = 0;
  for (double p = 0.02; p < 0.99; p += 0.02, ++count) {
    double mass = std::pow(1.0 - p, static_cast<double>(n));
    for (std::size_t k = 0; k <= n; ++k) {
      const Rate rate = wilson(k, n);
      if (rate.low <= p && p <= rate.high) coverage += mass;
      mass *= static_cast<double>(n - k) / static_cast<double>(k + 1) * p / (1.0 - p);
    }
  }
  EXPECT_NEAR(coverage / count, 0.95, 0.01);
}

TEST(Spread, IsOfThoseThatTell) {
  std::vector<RunRecord> records(6);
  for (int i = 0; i < 5; ++i) records[static_cast<std::size_t>(i)].closest_approach = i;
  std::vector<const RunRecord*> runs;
  for (const RunRecord& r : records) runs.push_back(&r);
  const Spread spread = spread_of(runs, "closest_approach");
  EXPECT_EQ(spread.count, 5u);
  EXPECT_DOUBLE_EQ(spread.mean, 2.0);
  EXPECT_DOUBLE_EQ(spread.p05, 0.2);
  EXPECT_DOUBLE_EQ(spread.p95, 3.8);
  EXPECT_EQ(spread_of(runs, "nothing").count, 0u);
}

TEST(Condition, ComparesRatesAndStatistics) {
  std::vector<RunRecord> records = {record(RunStatus::kCompleted, 0, 0.5),
                                    record(RunStatus::kEnded, 2, 0.1),
                                    record(RunStatus::kCompleted, 0, 0.9),
                                    record(RunStatus::kFailed, 0, 0.7)};
  records[0].figures["latency"] = 12.0;
  records[3].collisions.reset();  // it does not tell
  std::vector<const RunRecord*> runs;
  for (const RunRecord& r : records) runs.push_back(&r);
  EXPECT_TRUE(Condition("collision_rate > 0.3").holds(runs));
  EXPECT_FALSE(Condition("collision_rate > 0.34").holds(runs));
  EXPECT_TRUE(Condition("completed_rate<=0.5").holds(runs));
  EXPECT_TRUE(Condition(" failed_rate == 0.25 ").holds(runs));
  EXPECT_TRUE(Condition("min(closest_approach) < 0.2").holds(runs));
  EXPECT_TRUE(Condition("mean( latency ) >= 12").holds(runs));
  EXPECT_DOUBLE_EQ(Condition("max(collisions) > 1").value(runs), 2.0);
  for (const char* wrong : {"",
                            "collision_rate",
                            "collision_rate > ",
                            "collisions > 1",
                            "> 1",
                            "mean() > 1",
                            "mode(x) > 1",
                            "collision_rate => 1",
                            "mean(x > 1"}) {
    expect_contains(error_of([&] { Condition condition(wrong); }), "--fail-if");
  }
  expect_contains(error_of([&] { static_cast<void>(Condition("mean(nothing) > 1").holds(runs)); }),
                  "no run tells of nothing");
  // a planner that leaves no summary.json has no rate that is below anything
  std::vector<const RunRecord*> silent;
  const RunRecord untold;
  silent.push_back(&untold);
  expect_contains(
      error_of([&] { static_cast<void>(Condition("collision_rate > 0.02").holds(silent)); }),
      "no run tells of it");
  EXPECT_TRUE(Condition("failed_rate > 0.5").holds(silent));
}

TEST(Condition, ALimitIsANumber) {
  for (const char* text : {"collision_rate > nan", "collision_rate < inf", "collision_rate > "}) {
    EXPECT_NE(error_of([&] { Condition condition(text); }), "") << text;
  }
}

TEST(RunRecord, NumbersThatNoFlightComesToAreRefused) {
  const auto error = [](const std::string& json) {
    return error_of([&] { parse_record(json, "result.json"); });
  };
  EXPECT_NO_THROW(parse_record(R"({"status": "completed", "collisions": 3})", "result.json"));
  for (const char* wrong : {"1e300", "-1", "0.5", "1e308"}) {
    expect_contains(error(fmt::format(R"({{"status": "completed", "collisions": {}}})", wrong)),
                    "result.json: collisions");
  }
  expect_contains(error(R"({"status": "ended", "distance_flown": 1e300})"), "distance_flown");
  expect_contains(error(R"({"status": "ended", "figures": {"a": 1e300}})"), "result.json: a");
  const TemporaryFolder folder;
  testing::write_file(folder / "summary.json", R"({"vehicles": [{"collisions": 1e300}]})");
  RunRecord record;
  expect_contains(error_of([&] { read_results(folder.path(), "", record); }),
                  "summary.json: collisions");
}

TEST(Tables, HaveTheRunsInTheOrderOfThePlan) {
  Study study;
  study.seeds = {1, 2};
  study.grid = {{"vehicle.start", {"[0, 0]", "[1, 1]"}, 0}};
  const Plan plan = plan_of(study);
  Results results;
  results[3] = record(RunStatus::kEnded, 1, 0.0);
  results[3].end = "say \"hit\"";
  results[0] = record(RunStatus::kCompleted, 0, 0.25);
  results[0].figures["latency"] = 1e-9;
  EXPECT_EQ(runs_csv(plan, results),
            "run,point,seed,vehicle.start,status,reason,end,collisions,closest_approach,"
            "simulated_time,distance_flown,tracking_error_rms,tracking_error_max,latency\n"
            "0,0,1,\"[0, 0]\",completed,,,0,0.25,,,,,1e-09\n"
            "3,1,2,\"[1, 1]\",ended,,\"say \"\"hit\"\"\",1,0,,,,,\n");
  expect_contains(points_csv(plan, results), "0,\"[0, 0]\",1,1,0.206549,1,");
}

TEST(RunRecord, ComesBackFromItsFile) {
  RunRecord r = record(RunStatus::kFailed, 3, 0.125);
  r.reason = "signal 11";
  r.end = "mission unfinished";
  r.figures = {{"a", 1.5}, {"b", -2.0}};
  r.wall_seconds = 3.25;
  r.real_time_factor = 2.5;
  const RunRecord back = parse_record(record_json(r), "result.json");
  EXPECT_EQ(record_json(back), record_json(r));
  EXPECT_EQ(back.figures.at("b"), -2.0);
  EXPECT_FALSE(back.simulated_time);
  for (const char* wrong : {"", "[]", "{}", "{\"status\": 3}", "{\"status\": \"odd\"}"}) {
    EXPECT_NE(error_of([&] { parse_record(wrong, "result.json"); }), "") << wrong;
  }
}

TEST(RunRecord, TakesWhatARunLeaves) {
  const testing::TemporaryFolder folder;
  testing::write_file(folder / "summary.json",
                      R"({"end": "completed", "simulated_time": 3, "vehicles": [
    {"collisions": 1, "closest_approach": 0.5, "distance_flown": 2, "tracking_error_rms": 0.1},
    {"collisions": 2, "closest_approach": 0.25, "distance_flown": 3, "tracking_error_rms": 0.3}]})");
  testing::write_file(folder / "f.json", R"({"latency": 20.5})");
  RunRecord r;
  read_results(folder.path(), "f.json", r);
  EXPECT_EQ(r.end, "completed");
  EXPECT_EQ(r.collisions, 3);
  EXPECT_EQ(r.closest_approach, 0.25);
  EXPECT_EQ(r.distance_flown, 5.0);
  EXPECT_EQ(r.tracking_error_rms, 0.3);
  EXPECT_EQ(r.figures.at("latency"), 20.5);
  // names of columns: those that a summary has not filled
  testing::write_file(folder / "f.json", R"({"collisions": 3})");
  expect_contains(error_of([&] { read_results(folder.path(), "f.json", r); }),
                  "f.json: collisions: ");
  RunRecord own;
  std::filesystem::create_directory(folder / "own");
  testing::write_file(folder / "own/f.json", R"({"collisions": 3, "closest_approach": 0.5})");
  read_results(folder / "own", "f.json", own);
  EXPECT_EQ(own.collisions, 3);
  EXPECT_EQ(own.closest_approach, 0.5);
  EXPECT_TRUE(own.figures.empty());
  testing::write_file(folder / "own/f.json", R"({"wall_seconds": 3})");
  expect_contains(error_of([&] { read_results(folder / "own", "f.json", own); }), "another name");
  testing::write_file(folder / "f.json", R"({"latency": "much"})");
  expect_contains(error_of([&] { read_results(folder.path(), "f.json", r); }),
                  "figures are numbers");
  testing::write_file(folder / "f.json", "{");
  expect_contains(error_of([&] { read_results(folder.path(), "f.json", r); }), "no JSON object");
}

}  // namespace
}  // namespace pointflight
