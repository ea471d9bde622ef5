// Every command that writes, with files of somebody else's around its output: byte for byte what
// they were.
#include <csignal>
#include <filesystem>

#include "pointflight/core/owned_files.hpp"
#include "tests/integration/program.hpp"

namespace pointflight::testing {
namespace {

namespace fs = std::filesystem;

class Canary : public Program {
 protected:
  Canary() {
    fs::create_directories(here_ / "theirs/deep");
    write_file(here_ / "theirs/a", "precious");
    write_file(here_ / "theirs/summary.json", "{}");
    write_file(here_ / "theirs/deep/b", "precious, too");
    write_file(here_ / "theirs/two\nlines", "and this");
    fs::create_symlink("nowhere", here_ / "theirs/dangling");
    fs::create_symlink("loop", here_ / "theirs/loop");
    fs::create_directory_symlink("..", here_ / "theirs/deep/up");
    fs::create_hard_link(here_ / "theirs/a", here_ / "theirs/second name");
    before_ = snapshot(here_ / "theirs");
    write_file(here_ / "s.yaml",
               "map: " + map() + "\nduration: 0.2\nvehicle: {start: [12, 10, 4]}\n");
  }
  ~Canary() override { EXPECT_EQ(snapshot(here_ / "theirs"), before_); }

  [[nodiscard]] std::string in(const std::string& name) const { return here_ / name; }
  [[nodiscard]] std::string theirs(const std::string& name = "") const {
    return here_ / ("theirs/" + name);
  }
  /// Links to theirs of all kinds, a second name, and files of their own.
  void put_theirs_into(const std::string& folder) const {
    fs::create_directories(folder);
    fs::create_directory_symlink(theirs(), folder + "/l");
    fs::create_symlink(theirs("a"), folder + "/link");
    fs::create_symlink("nowhere", folder + "/dangling");
    fs::create_directory_symlink("..", folder + "/parent");
    fs::create_hard_link(theirs("deep/b"), folder + "/second");
    write_file(folder + "/mine.bag", "a bag of mine");
    fs::create_directory(folder + "/logs");
    write_file(folder + "/logs/\n", "named by its end of line");
  }
  static void expect_theirs_in(const std::string& folder) {
    const auto all = snapshot(folder);
    for (const char* name :
         {"l", "link", "dangling", "parent", "second", "mine.bag", "logs", "logs/\n"}) {
      EXPECT_TRUE(all.contains(name)) << folder << ": " << name;
    }
  }
  Result fly(const std::string& more) { return run("fly " + in("s.yaml") + " " + more); }

  TemporaryFolder here_;

 private:
  std::map<std::string, std::string> before_;
};

TEST_F(Canary, FlyForceRemovesTheEarlierRunAlone) {
  ASSERT_EQ(fly("-o " + in("run")).code, 0);
  put_theirs_into(in("run"));
  // whatever the list says besides
  write_file(in("run/files.txt"),
             read_file(in("run/files.txt")) +
                 "l/a\nl/deep/b\nparent/theirs/a\nlink@x\nlink\ndangling\nlogs\nl\n../theirs/a\n" +
                 theirs("a") + "\n\n..\nfiles.txt\n");
  const Result again = fly("--force -o " + in("run"));
  EXPECT_EQ(again.code, 0) << again.err;
  expect_theirs_in(in("run"));
  EXPECT_FALSE(read_file(in("run/summary.json")).empty());
}

TEST_F(Canary, FlyForceReplacesNothingThatNoRunWrote) {
  const auto refused = [&](const std::string& words) {
    const auto all = snapshot(in("run"));
    expect_user_error(fly("--force -o " + in("run")), words);
    EXPECT_EQ(snapshot(in("run")), all);
  };
  put_theirs_into(in("run"));
  fs::create_symlink(theirs("a"), in("run/summary.json"));
  fs::rename(in("run/summary.json"), in("run/trajectory.csv"));
  refused("trajectory.csv: was not written by an earlier run");
  fs::remove(in("run/trajectory.csv"));
  fs::create_directory_symlink(theirs(), in("run/scans"));
  refused("/scans/0_000000.pcd: was not written by an earlier run");
  fs::remove(in("run/scans"));
  write_file(in("run/files.txt"), "mine.bag\nlogs\n");  // as `ls >files.txt` leaves it
  refused("files.txt: is not the list of a run's files");
  fs::remove(in("run/files.txt"));
  fs::create_symlink(theirs("a"), in("run/files.txt"));
  refused("files.txt: is not the list of a run's files");
  fs::remove(in("run/files.txt"));
  for (const char* name : {".partial", ".killed"}) {
    fs::create_directory_symlink(theirs(), in("run/") + name);
    refused("was not made by a run");
    fs::remove(in("run/") + name);
    put_theirs_into(in("run/") + name);
    refused("was not made by a run");
    fs::rename(in("run/") + name, in("away") + name);
  }
  EXPECT_EQ(fly("--force -o " + in("run")).code, 0);
  expect_theirs_in(in("run"));
}

TEST_F(Canary, WhatAKilledFlightLeftGoesAndNothingElse) {
  write_file(in("s.yaml"), "map: " + map() + "\nduration: 100\nvehicle: {start: [12, 10, 4]}\n");
  const Started started("fly " + in("s.yaml") + " --rate 1 -o " + in("run"));
  ASSERT_TRUE(started.waits_for(in("run/.partial/scans/0_000001.pcd")));
  static_cast<void>(started.end(SIGKILL));
  put_theirs_into(in("run/.partial/scans"));
  write_file(in("s.yaml"), "map: " + map() + "\nduration: 0.2\nvehicle: {start: [12, 10, 4]}\n");
  const Result again = fly("--force -o " + in("run"));
  EXPECT_EQ(again.code, 0) << again.err;
  expect_theirs_in(in("run/.killed/scans"));
  EXPECT_FALSE(fs::exists(in("run/.killed/scans/0_000001.pcd")));
  EXPECT_FALSE(fs::exists(in("run/.killed/trajectory.csv.partial")));
  expect_user_error(fly("--force -o " + in("run")), ".killed: was not made by a run");
}

TEST_F(Canary, ACampaignKeepsWhatAProgramOfTheUsersWrote) {
  // a link in the place of its output, as people make it to a scratch disk; logs; links within
  const std::string program = in("own.sh");
  write_file(program,
             fmt::format("#!/bin/sh\n# SEED OUTPUT\ncase $1 in\n"
                         "1) rm -rf $2; ln -s {0} $2 ;;\n"
                         "2) echo log >$2/my.log; ln -s {0} $2/l; ln -s {0}/a $2/events.csv ;;\n"
                         "3) echo log >$2/my.log; ln {0}/a $2/second; exit 9 ;;\n"
                         "4) rm -rf $2; ln -s .. $2 ;;\n"
                         "5) rm -rf $2; ln -s {0}/nowhere $2; kill -SEGV $$ ;;\nesac\n",
                         theirs()));
  fs::permissions(program, fs::perms::owner_all);
  for (const char* keep : {"", "keep: results\n", "keep: all\n"}) {
    const std::string folder = in(fmt::format("c{}", fs::path(keep).string().size()));
    write_file(in("study.yaml"),
               fmt::format("scenario: s.yaml\nseeds: 5\n{}command: [{}, '{{seed}}', '{{output}}', "
                           "'{{scenario}}']\n",
                           keep,
                           program));
    const std::string command = fmt::format("campaign {} -o {}", in("study.yaml"), folder);
    const Result result = run(command);
    EXPECT_EQ(result.code, 0) << result.err;
    expect_contains(result.out, "5 of 5 flights");
    EXPECT_EQ(fs::read_symlink(folder + "/runs/000000/output"), theirs());
    EXPECT_EQ(read_file(folder + "/runs/000001/output/my.log"), "log\n");
    EXPECT_TRUE(fs::is_symlink(folder + "/runs/000001/output/l"));
    // what failed is flown again, and what it left stays
    EXPECT_EQ(run(command + " --retry-failed").code, 0);
    EXPECT_EQ(read_file(folder + "/runs/000002.aside-1/output/my.log"), "log\n");
    EXPECT_EQ(read_file(folder + "/runs/000002/output/my.log"), "log\n");
    EXPECT_FALSE(fs::exists(folder + "/runs/000002.aside-1/scenario.yaml"));
  }
}

TEST_F(Canary, ACampaignThatIsKilledLeavesTheUsersFiles) {
  const std::string program = in("own.sh");
  write_file(program,
             fmt::format("#!/bin/sh\necho log >$1/my.log; ln -s {} $1/l; touch {}; sleep 60\n",
                         theirs(),
                         in("started")));
  fs::permissions(program, fs::perms::owner_all);
  write_file(
      in("study.yaml"),
      fmt::format("scenario: s.yaml\nseeds: 1\ncommand: [{}, '{{output}}', '{{scenario}}']\n",
                  program));
  const std::string command = fmt::format("campaign {} -o {}", in("study.yaml"), in("c"));
  for (const int signal : {SIGKILL, SIGINT}) {
    fs::remove(in("started"));
    const Started started(command);
    ASSERT_TRUE(started.waits_for(in("started")));
    static_cast<void>(started.end(signal));
  }
  write_file(program, "#!/bin/sh\nexit 0\n");
  const Result result = run(command);
  EXPECT_EQ(result.code, 0) << result.err;
  expect_contains(result.err, "2 interrupted flights left files of your program in");
  int left = 0;
  for (const auto& entry : fs::directory_iterator(in("c/runs"))) {
    if (entry.path().filename().string().find(".attempt-") == std::string::npos) continue;
    ++left;
    EXPECT_EQ(read_file(entry.path() / "output/my.log"), "log\n");
    EXPECT_FALSE(fs::exists(entry.path() / "scenario.yaml"));
  }
  EXPECT_EQ(left, 2);
}

TEST_F(Canary, ACampaignTakesNoFolderThatIsNotItsOwn) {
  write_file(in("study.yaml"), "scenario: s.yaml\nseeds: 1\n");
  const auto campaign = [&](const std::string& folder) {
    return run(fmt::format("campaign {} -o {}", in("study.yaml"), folder));
  };
  fs::create_directories(in("mine/runs/000000"));
  write_file(in("mine/runs/000000/log.txt"), "mine");
  expect_user_error(campaign(in("mine")), "is not empty, and no campaign");
  EXPECT_EQ(read_file(in("mine/runs/000000/log.txt")), "mine");
  ASSERT_EQ(campaign(in("c")).code, 0);
  fs::remove(in("c/runs/000000/result.json"));
  put_theirs_into(in("c/runs/000000"));
  put_theirs_into(in("c/runs/000000/output/deep"));
  fs::create_directory_symlink(theirs(), in("c/runs/000001.attempt-nobody-1-1"));
  EXPECT_EQ(campaign(in("c")).code, 0);
  expect_theirs_in(in("c/runs/000000.aside-1"));
  expect_theirs_in(in("c/runs/000000.aside-1/output/deep"));
  fs::rename(in("c/runs"), in("runs"));
  fs::create_directory_symlink(in("runs"), in("c/runs"));
  expect_user_error(campaign(in("c")), "c/runs: cannot be used as a folder: it is a link");
}

TEST_F(Canary, OutputsOfCommandsReplaceNoLinkNoInputAndNotEachOther) {
  fs::copy_file(map(), in("m.pfmap"));
  fs::copy_file(cloud(), in("c.pcd"));
  fs::create_symlink(theirs("a"), in("l.pfmap"));
  fs::create_symlink(theirs("a"), in("l.pcd"));
  fs::create_symlink(theirs("a"), in("l.png"));
  fs::create_symlink("/proc/self/fd/1", in("stdout"));  // as /dev has it
  fs::create_symlink(theirs("a"), in("x.pfmap.partial"));
  const auto all = snapshot(here_.path());
  const std::string at = "cd " + here_.path() + " &&";
  for (const char* command : {"map import c.pcd -o l.pfmap",
                              "map import c.pcd -o x.pfmap",
                              "map import c.pcd -o c.pcd",
                              "map import c.pcd -o stdout",
                              "map import c.pcd -o x.pcd --export-outliers ./x.pcd",
                              "map import c.pcd -o y.pfmap --export-outliers y.pfmap.partial",
                              "map import c.pcd -o y.pfmap --export-outliers c.pcd",
                              "map crop m.pfmap --box 0,0,0,9,9,9 -o l.pfmap",
                              "map crop m.pfmap --box 0,0,0,9,9,9 -o y.pfmap --png y.pfmap",
                              "map crop m.pfmap --box 0,0,0,9,9,9 -o y.pfmap --png ./y.pfmap",
                              "map crop c.pcd --box 0,0,0,9,9,9 -o y.pcd --png ../{}/y.pcd",
                              "map crop c.pcd --box 0,0,0,9,9,9 -o y.pcd --png c.pcd",
                              "map thin c.pcd --spacing 0.5 -o y.pcd --png y.pcd",
                              "map thin c.pcd --spacing 0.5 -o l.pcd",
                              "map transform m.pfmap --pose 1,0,0,0,0,0 -o y.pfmap --png y.pfmap",
                              "map merge m.pfmap m.pfmap -o y.pfmap --png y.pfmap",
                              "map merge m.pfmap m.pfmap -o y.pfmap --png m.pfmap",
                              "map export m.pfmap -o y.ply --png y.ply",
                              "map export m.pfmap -o l.pcd",
                              "map diff m.pfmap m.pfmap -o y.pcd --png y.pcd",
                              "map diff m.pfmap m.pfmap --png m.pfmap",
                              "map info m.pfmap --png l.png",
                              "map info m.pfmap --png m.pfmap",
                              "map forest --size-x 5 --size-y 5 -o l.pcd",
                              "scenario new m.pfmap -o l.pcd",
                              "scan m.pfmap --pose 12,10,4,0,0,0 -o y.pcd --png y.pcd",
                              "scan m.pfmap --pose 12,10,4,0,0,0 --png m.pfmap",
                              "lidar show mid360 --png l.png",
                              "vehicle show quad_330 --png l.png"}) {
    std::string words = command;
    if (const auto place = words.find("{}"); place != std::string::npos) {
      words.replace(place, 2, fs::path(here_.path()).filename().string());
    }
    const Result result = run(words + " --force", at);
    EXPECT_EQ(result.code, 2) << words << "\n" << result.err;
    EXPECT_EQ(snapshot(here_.path()), all) << words;
  }
}

TEST_F(Canary, AFitDoesNotReplaceItsScans) {
  fs::create_directory(in("scans"));
  fs::copy_file(cloud(), in("scans/1.pcd"));
  fs::copy_file(cloud(), in("scans/2.pcd"));
  write_file(in("poses.tum"), "0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n");
  fs::copy_file(map(), in("m.pfmap"));
  const auto all = snapshot(here_.path());
  for (const std::string command : {"map fit m.pfmap", "map import c.pcd"}) {
    for (const char* ghosts : {"scans/1.pcd", "poses.tum", "m.pfmap", "./f.pfmap"}) {
      const std::string words = fmt::format(
          "{} --scans scans --poses poses.tum -o f.pfmap --export-ghosts {}", command, ghosts);
      if (command != "map fit m.pfmap" && std::string(ghosts) == "m.pfmap") continue;
      const Result result = run(words + " --force", "cd " + here_.path() + " &&");
      EXPECT_EQ(result.code, 2) << words;
      expect_contains(result.err, "this command reads or writes that file already");
      EXPECT_EQ(snapshot(here_.path()), all) << words;
    }
  }
}

TEST_F(Canary, APictureReplacesNothingButARunsOwn) {
  ASSERT_EQ(fly("--no-picture -o " + in("run")).code, 0);
  put_theirs_into(in("run"));
  fs::create_symlink(theirs("a"), in("run/overview.png"));
  expect_user_error(run("picture --force " + in("run")), "is a symbolic link");
  fs::remove(in("run/overview.png"));
  write_file(in("run/overview.png"), "mine");
  expect_user_error(run("picture " + in("run")), "is there already");
  expect_user_error(fly("--force -o " + in("run")), "overview.png: was not written by an earlier");
  EXPECT_EQ(read_file(in("run/overview.png")), "mine");
  fs::remove(in("run/overview.png"));
  // its own: drawn again and again, and a part of the run
  for (int i = 0; i < 2; ++i) EXPECT_EQ(run("picture " + in("run")).code, 0);
  expect_user_error(run(fmt::format("picture {0} -o {0}/scans.csv --force", in("run"))),
                    "reads or writes that file already");
  fs::create_directory(in("frames"));
  fs::create_symlink(theirs("a"), in("frames/000000.png"));
  expect_user_error(run(fmt::format("picture {} --frames {} --force", in("run"), in("frames"))),
                    "is a symbolic link");
  EXPECT_EQ(fly("--force -o " + in("run")).code, 0);
  expect_theirs_in(in("run"));
}

TEST_F(Canary, ARunsTablesLeadToNoFileElsewhere) {
  ASSERT_EQ(fly("-o " + in("run")).code, 0);
  fs::copy_file(cloud(), in("elsewhere.pcd"));
  fs::create_symlink(in("elsewhere.pcd"), in("run/scans/link.pcd"));
  const std::string table = read_file(in("run/scans.csv"));
  for (const std::string& name : {in("elsewhere.pcd"),
                                  std::string("../elsewhere.pcd"),
                                  std::string("scans/link.pcd"),
                                  std::string("scans")}) {
    std::string other = table;
    other.replace(other.find("scans/0_000000.pcd"), 18, name);
    write_file(in("run/scans.csv"), other);
    expect_user_error(run("picture --force " + in("run")), "no file in the run's folder");
  }
}

TEST_F(Canary, RecordingsReplaceNoLinkAndNoSecondName) {
  fs::create_symlink(theirs("a"), in("a.mcap"));
  fs::create_symlink(theirs("a"), in("b.mcap.active"));
  fs::create_hard_link(theirs("a"), in("c.mcap.active"));
  fs::create_symlink(theirs("a"), in("d.bag.active"));
  for (const char* name : {"a.mcap", "b.mcap", "c.mcap", "d.bag"}) {
    const Result result = fly(fmt::format("--force --record {}", in(name)));
    EXPECT_EQ(result.code, 2) << name << result.err;
  }
}

TEST_F(Canary, MountsInARunsFolderStay) {
  // a name space of its own, in which theirs lies in the run's folder
  if (std::system("unshare -rm true 2>/dev/null") != 0) GTEST_SKIP() << "no mounts for this user";
  ASSERT_EQ(fly("-o " + in("run")).code, 0);
  fs::create_directory(in("run/m"));
  write_file(in("run/files.txt"), read_file(in("run/files.txt")) + "m/a\nm/deep/b\nm/x.pcd\n");
  const std::string mounted = fmt::format(
      "unshare -rm sh -c 'mount --bind {} {} && exec \"$@\"' sh", theirs(), in("run/m"));
  const Result again = run("fly " + in("s.yaml") + " --force -o " + in("run"), mounted);
  EXPECT_EQ(again.code, 0) << again.err;
  const std::string over_scans = fmt::format(
      "unshare -rm sh -c 'mount --bind {} {} && exec \"$@\"' sh", theirs(), in("run/scans"));
  const Result refused = run("fly " + in("s.yaml") + " --force -o " + in("run"), over_scans);
  expect_user_error(refused, "scans/0_000000.pcd: was not written by an earlier run");
}

}  // namespace
}  // namespace pointflight::testing
