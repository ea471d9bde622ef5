// Campaigns as users run them: tables, failures, going on after a kill, verdicts.
#include <csignal>
#include <filesystem>

#include "pointflight/core/resources.hpp"
#include "tests/integration/program.hpp"
#include "tests/paths.hpp"

namespace pointflight::testing {
namespace {

namespace fs = std::filesystem;

class Campaigns : public Program {
 protected:
  void SetUp() override {
    write_file(here_ / "s.yaml",
               "map: " + map() +
                   "\nduration: 0.3\nvehicle: {start: [12, 10, 6]}\nlidars: []\nmission: "
                   "{waypoints: [[14, 10, 6]]}\noutput: {scans: false, imu: false}\n");
  }
  std::string study(const std::string& rest) {
    write_file(here_ / "study.yaml", "scenario: s.yaml\n" + rest);
    return here_ / "study.yaml";
  }
  std::string table(const std::string& folder, const std::string& name = "runs.csv") {
    return read_file((fs::path(here_ / folder) / name).string());
  }
  TemporaryFolder here_;
};

TEST_F(Campaigns, FlyAGridAndTellWhatCameOfIt) {
  const std::string file = study("seeds: 2\ngrid: {mission.speed: [1, 2]}\n");
  const Result result = run(fmt::format("campaign {} -o {}", file, here_ / "c"));
  EXPECT_EQ(result.code, 0) << result.err;
  expect_contains(result.out, "4 of 4 flights");
  const std::string runs = table("c");
  EXPECT_EQ(std::count(runs.begin(), runs.end(), '\n'), 5);
  expect_contains(runs, "\n0,0,1,1,ended,,mission unfinished,0,");
  expect_contains(runs, "\n3,1,2,2,ended,");
  expect_contains(table("c", "points.csv"), "\n1,2,2,0,0,");
  expect_contains(table("c", "plot_mission_speed.svg"), "<svg");
  const std::string html = table("c", "report.html");
  expect_contains(html, "4 flights of s.yaml");
  EXPECT_EQ(html.find("<script"), std::string::npos);
  EXPECT_EQ(html.find("src="), std::string::npos);
  EXPECT_TRUE(fs::exists(here_ / "c/runs/000003/output/summary.json"));
  EXPECT_FALSE(fs::exists(here_ / "c/runs/000003/output/trajectory.csv"));
  // a flight's scenario flies by itself, and to the same end
  ASSERT_LE(
      run(fmt::format("fly {} -o {}", here_ / "c/runs/000003/scenario.yaml", here_ / "r")).code, 1);
  EXPECT_EQ(read_file(here_ / "r/summary.json"),
            read_file(here_ / "c/runs/000003/output/summary.json"));
  // once more: nothing is flown, all is said again
  const auto before = fs::last_write_time(here_ / "c/runs/000000/result.json");
  EXPECT_EQ(run(fmt::format("campaign {} -o {}", file, here_ / "c")).code, 0);
  EXPECT_EQ(fs::last_write_time(here_ / "c/runs/000000/result.json"), before);
  EXPECT_EQ(table("c"), runs);
}

TEST_F(Campaigns, ValuesThatDoNotFitTogetherAreAFlightThatFailed) {
  const std::string file =
      study("seeds: 1\ngrid: {share.time: [lockstep, free], share.ahead: [0, 5]}\n");
  write_file(here_ / "s.yaml", read_file(here_ / "s.yaml") + "share: {time: lockstep}\n");
  const Result result = run(fmt::format("campaign {} -o {}", file, here_ / "c"));
  EXPECT_EQ(result.code, 0) << result.err;
  const std::string runs = table("c");
  expect_contains(runs, ",failed,values that do not fit together,");
  expect_contains(runs, "\n0,0,1,lockstep,0,ended,");
  expect_contains(read_file(here_ / "c/runs/000003/log.txt"), "ahead");
}

TEST_F(Campaigns, TakeKeysThatOnlyMakeSenseTogetherAndOtherMaps) {
  // gusts of one's own need turbulence: custom, which the scenario does not have
  const std::string gusts = study(
      "seeds: 1\ngrid: {air.wind.turbulence: [custom], air.wind.gust_sigma: [[1, 1, 1], [2, 2, "
      "2]]}\n");
  const Result windy = run(fmt::format("campaign {} -o {}", gusts, here_ / "windy"));
  EXPECT_EQ(windy.code, 0) << windy.err;
  expect_contains(windy.out, "2 of 2 flights");
  EXPECT_EQ(table("windy").find(",failed,"), std::string::npos);
  // nothing says that the second map is the first
  fs::copy(map(), here_ / "same.pfmap");
  ASSERT_EQ(
      run(fmt::format("map crop {} -o {} --box 0,0,-50,100,100,8", map(), here_ / "low.pfmap"))
          .code,
      0);
  const std::string maps = study(fmt::format("seeds: 1\ngrid: {{map: [same.pfmap, low.pfmap]}}\n"));
  const Result result = run(fmt::format("campaign {} -o {}", maps, here_ / "maps"));
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(table("maps").find(",failed,"), std::string::npos) << table("maps");
  EXPECT_NE(read_file(here_ / "maps/runs/000000/scenario.yaml"),
            read_file(here_ / "maps/runs/000001/scenario.yaml"));
}

TEST_F(Campaigns, WhatIsHalfTakenAwayIsFlownAgain) {
  const std::string file = study("seeds: 3\n");
  ASSERT_EQ(run(fmt::format("campaign {} -o {}", file, here_ / "c")).code, 0);
  const std::string runs = table("c");
  fs::remove(here_ / "c/runs/000001/result.json");  // as a --retry-failed that was killed leaves it
  const Result again = run(fmt::format("campaign {} -o {}", file, here_ / "c"));
  EXPECT_EQ(again.code, 0) << again.err;
  EXPECT_EQ(table("c"), runs);
}

TEST_F(Campaigns, OfAnotherInputAreRefused) {
  const std::string file = study("seeds: 1\ngrid: {mission.speed: [1]}\n");
  fs::copy(data_folder() + "/vehicles/quad_330.yaml", here_ / "mine.yaml");
  std::string text = read_file(here_ / "s.yaml");
  write_file(here_ / "s.yaml", text.insert(text.find("start:"), "model: mine.yaml, "));
  ASSERT_EQ(run(fmt::format("campaign {} -o {}", file, here_ / "c")).code, 0);
  write_file(here_ / "mine.yaml", read_file(here_ / "mine.yaml") + "\n# heavier now\n");
  const Result other = run(fmt::format("campaign {} -o {}", file, here_ / "c"));
  EXPECT_EQ(other.code, 2);
  expect_contains(other.err, "another study, scenario, map, input or version");
}

TEST_F(Campaigns, GoOnAfterAKillAndComeToTheSame) {
  const std::string file = study("seeds: 12\ngrid: {mission.speed: [1, 2]}\n");
  ASSERT_EQ(run(fmt::format("campaign {} -o {}", file, here_ / "whole")).code, 0);
  for (int kills = 1; kills <= 3; ++kills) {
    const Started started(fmt::format("campaign {} -o {} --jobs 2", file, here_ / "killed"));
    ASSERT_TRUE(started.waits_for(here_ / fmt::format("killed/runs/{:06}", 5 * kills)));
    static_cast<void>(started.end(SIGKILL));
  }
  EXPECT_EQ(run(fmt::format("campaign {} -o {}", file, here_ / "killed")).code, 0);
  EXPECT_EQ(table("killed"), table("whole"));
  EXPECT_EQ(table("killed", "points.csv"), table("whole", "points.csv"));
  for (const auto& entry : fs::directory_iterator(here_ / "killed/runs")) {
    EXPECT_EQ(entry.path().filename().string().find("attempt"), std::string::npos);
  }
}

TEST_F(Campaigns, EndWhenTheyAreInterruptedAndSayHowToGoOn) {
  const std::string file = study("seeds: 200\n");
  const Started started(fmt::format("campaign {} -o {}", file, here_ / "c"));
  ASSERT_TRUE(started.waits_for(here_ / "c/runs/000002"));
  EXPECT_EQ(started.end(SIGINT), 130);
  expect_contains(started.err(), "flights are left (it was ended); the same command goes on");
  EXPECT_TRUE(fs::exists(here_ / "c/runs.csv"));
}

TEST_F(Campaigns, SharesAreFlownByWorkersAndGathered) {
  const std::string file = study("seeds: 6\n");
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(run(fmt::format("campaign {} -o {} --share {}/3", file, here_ / "c", i)).code, 0);
    EXPECT_TRUE(fs::exists(here_ / fmt::format("c/runs/{:06}/result.json", i + 3)));
    EXPECT_FALSE(fs::exists(here_ / "c/runs.csv"));
  }
  EXPECT_EQ(run(fmt::format("campaign {} -o {}", file, here_ / "c")).code, 0);
  ASSERT_EQ(run(fmt::format("campaign {} -o {}", file, here_ / "alone")).code, 0);
  EXPECT_EQ(table("c"), table("alone"));
}

TEST_F(Campaigns, AUsersProgramIsJudgedByItsCodeItsFiguresAndItsLimits) {
  write_file(here_ / "own.sh",
             "#!/bin/sh\n# SCENARIO SEED OUTPUT\ngrep -q 'seed: '$2 $1 || exit 9\n"
             "case $2 in\n1) echo '{\"latency\": 12.5}' >$3/figures.json ;;\n2) exit 1 ;;\n"
             "3) echo broken; exit 7 ;;\n4) kill -SEGV $$ ;;\n5) sleep 60 ;;\n"
             "6) echo '{\"latency\": []}' >$3/figures.json ;;\nesac\n");
  fs::permissions(here_ / "own.sh", fs::perms::owner_all);
  const std::string file = study(fmt::format(
      "seeds: 6\ncommand: [{}, '{{scenario}}', '{{seed}}', '{{output}}']\nlimits: {{time: 4}}\n"
      "figures: figures.json\n",
      here_ / "own.sh"));
  const Result result = run(fmt::format("campaign {} -o {}", file, here_ / "c"));
  EXPECT_EQ(result.code, 0) << result.err;
  expect_contains(result.out, "failed            4 of 6");
  expect_contains(result.out,
                  "flight 2 failed: exit code 7; log: " + (here_ / "c") + "/runs/000002/log.txt");
  expect_contains(result.out,
                  fmt::format("again: cd {0} && mkdir -p again && {0}/own.sh", here_.path()));
  EXPECT_EQ(table("c"),
            "run,point,seed,status,reason,end,collisions,closest_approach,simulated_time,"
            "distance_flown,tracking_error_rms,tracking_error_max,latency\n"
            "0,0,1,completed,,,,,,,,,12.5\n1,0,2,ended,,,,,,,,,\n2,0,3,failed,exit code 7,,,,,,,,\n"
            "3,0,4,failed,signal 11,,,,,,,,\n4,0,5,failed,took longer than 4 s,,,,,,,,\n"
            "5,0,6,failed,results that cannot be read,,,,,,,,\n");
  EXPECT_EQ(read_file(here_ / "c/runs/000002/log.txt"), "broken\n");
  // those that failed once more, and no others
  write_file(here_ / "own.sh", "#!/bin/sh\nexit 0\n");
  fs::permissions(here_ / "own.sh", fs::perms::owner_all);
  EXPECT_EQ(run(fmt::format("campaign {} -o {} --retry-failed", file, here_ / "c")).code, 0);
  expect_contains(table("c"), "1,0,2,ended,");
  expect_contains(table("c"), "2,0,3,completed,");
}

TEST_F(Campaigns, AUsersProgramMayLockItsFolder) {
  const std::string file =
      study("seeds: 2\ncommand: [sh, -c, 'flock -w 20 \"$(dirname {scenario})\" true']\n");
  const Result result = run(fmt::format("campaign {} -o {}", file, here_ / "c"));
  EXPECT_EQ(result.code, 0) << result.err;
  expect_contains(table("c"), "0,0,1,completed,");
  expect_contains(table("c"), "1,0,2,completed,");
}

TEST_F(Campaigns, WithTooLittleMemoryEndInALineAndGoOn) {
  if (testing::kSanitized) return;  // the sanitizers take far more, and have a malloc of their own
  const auto expect_it_goes_on = [&](const std::string& command, const Result& result) {
    EXPECT_TRUE(result.code == 0 || result.code == 2) << result.code << result.err;
    if (result.code != 2) return;
    expect_contains(result.err, "pointflight: ");
    EXPECT_EQ(result.err.find("terminate"), std::string::npos) << result.err;
    EXPECT_EQ(run(command).code, 0);
    for (const auto& entry : fs::directory_iterator(here_ / "many/runs")) {
      EXPECT_EQ(entry.path().filename().string().find("attempt"), std::string::npos)
          << entry.path();
    }
  };
  const auto study_of = [&](const std::string& name, int flights, const std::string& first) {
    write_file(here_ / name,
               fmt::format("scenario: s.yaml\nseeds: {}\n"
                           "command: [sh, -c, '{}; echo {{scenario}}']\n",
                           flights,
                           first));
    return fmt::format("campaign {} -o {}", here_ / name, here_ / "many");
  };
  const std::string many = study_of("many.yaml", 300, "sleep 0.05");
  expect_it_goes_on(many, run(many + " --jobs 200", "ulimit -v 600000;"));
  // wherever it is that there is none, destructors included
  const std::string few = study_of("few.yaml", 8, ":");
  for (int seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE(seed);
    fs::remove_all(here_ / "many");
    expect_it_goes_on(few,
                      run(few + " --jobs 4",
                          fmt::format("SCARCE_FROM=15000 SCARCE_RATE=2000 SCARCE_SEED={} "
                                      "LD_PRELOAD='{}'",
                                      seed,
                                      testing::kScarceMemory)));
  }
}

TEST_F(Campaigns, VerdictsAreExitCodes) {
  const std::string file = study("seeds: 2\n");
  const std::string command = fmt::format("campaign {} -o {} --fail-if ", file, here_ / "c");
  EXPECT_EQ(run(command + "'collision_rate > 0.02'").code, 0);
  const Result failed = run(command + "'completed_rate < 0.5'");
  EXPECT_EQ(failed.code, 1);
  expect_contains(failed.err, "--fail-if completed_rate < 0.5: it is 0");
  expect_user_error(run(command + "'collision_rate > nan'"), "write it like");
  expect_user_error(run(command + "'what'"), "--fail-if what: write it like");
  expect_user_error(run(command + "'mean(latency) > 1'"), "no run tells of latency");
}

TEST_F(Campaigns, MistakesAreSaidBeforeAnythingFlies) {
  const auto fly = [&](const std::string& rest) {
    return run(fmt::format("campaign {} -o {}", study(rest), here_ / "c"));
  };
  expect_user_error(fly("grid: {mission.speeed: [1]}\n"),
                    "study.yaml:2: mission.speeed: unknown key");
  expect_user_error(fly("grid: {mission.speed: [1, -1]}\n"), "study.yaml:2: mission.speed: -1");
  expect_user_error(fly("grid:\n  obstacles[0].count: [1]\n"), "the scenario has 0 of these");
  expect_user_error(fly("draws:\n  count: 1\n  mission.speed: {uniform: [1, 1e6]}\n"),
                    "study.yaml:4: mission.speed:");
  expect_user_error(fly("grid: {map: [nowhere.pfmap]}\n"), "study.yaml:2: map: ");
  expect_user_error(fly("grid: {vehicle.model: [./nowhere.yaml]}\n"),
                    "study.yaml:2: vehicle.model: ");
  const std::string good = study("seeds: 1\n");
  expect_user_error(run(fmt::format("campaign {} -o {} --share 3/3", good, here_ / "c")),
                    "write it like 0/16");
  EXPECT_FALSE(fs::exists(here_ / "c"));
  expect_user_error(
      run(fmt::format("campaign {} -o ''", good), fmt::format("cd {} &&", here_.path())),
      "-o: the folder of the results has no name");
  expect_user_error(run(fmt::format("campaign {} -o {}", good, here_.path())),
                    "is not empty, and no campaign");
  ASSERT_EQ(fly("seeds: 1\n").code, 0);
  expect_user_error(fly("seeds: 2\n"), "is the campaign of another study");
  expect_user_error(
      run(fmt::format(
          "campaign {} -o {} --share 1/2 --engine slurm", here_ / "study.yaml", here_ / "c")),
      "--share");
  for (const char* idle : {"--tasks 3", "--share 0/2 --json"}) {
    expect_user_error(
        run(fmt::format("campaign {} -o {} {}", here_ / "study.yaml", here_ / "c", idle)), "go");
  }
}

}  // namespace
}  // namespace pointflight::testing
