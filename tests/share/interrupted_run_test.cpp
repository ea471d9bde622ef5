// What a process that was killed left of a shared run, and where the next one goes on from it.
#include "pointflight/sim/interrupted_run.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "pointflight/share/common_ground.hpp"
#include "pointflight/sim/flight_recorder.hpp"
#include "pointflight/sim/run_folder.hpp"
#include "tests/share/members.hpp"

namespace pointflight {
namespace {

namespace fs = std::filesystem;

using testing::Bus;
using testing::error_of;
using testing::expect_contains;
using testing::Member;
using testing::read_file;
using testing::TemporaryFolder;
using testing::through_each_other;
using testing::write_file;

/// A scenario's copy names its map.
Scenario of_a_map() {
  Scenario scenario = through_each_other();
  scenario.map = "hall.pfmap";
  return scenario;
}

/// Where the vehicles were at each instant, beside the files.
class Truth : public SampleSink {
 public:
  explicit Truth(FlightRecorder& recorder) : recorder_(recorder) {}
  void on_sample(const Sample& sample) override {
    recorder_.on_sample(sample);
    if (const auto* s = std::get_if<StateSample>(&sample)) states[s->vehicle][s->time] = s->state;
  }
  std::map<std::size_t, std::map<SimTime, VehicleState>> states;

 private:
  FlightRecorder& recorder_;
};

/// Two vehicles of one process that was killed after some two seconds.
class EndedRunTest : public ::testing::Test {
 protected:
  EndedRunTest()
      : bus_([this] { return now_; }),
        member_(
            bus_, of_a_map(), {0, 1}, [this] { return now_; }, 1),
        killed_(folder_ / "killed") {
    FlightRecorder recorder(folder_ / "run", member_.simulation, Existing::kRefuse);
    Truth truth(recorder);
    const SimTime end(std::chrono::milliseconds(2050));
    while (member_.simulation.time() < end && member_.simulation.step(truth)) {
    }
    truth_ = std::move(truth.states);
    // as a kill leaves it: the recorder has had no time to take its files away
    fs::create_directory(killed_);
    fs::copy(staging_of(folder_ / "run"), staging_of(killed_), fs::copy_options::recursive);
  }

  [[nodiscard]] std::string trajectory(const std::string& vehicle) const {
    return (fs::path(staging_of(killed_)) / vehicle / "trajectory.csv.partial").string();
  }
  [[nodiscard]] std::optional<InterruptedRun> ended() const {
    return ended_run(killed_, member_.simulation, {0, 1});
  }
  void expect_truth(const InterruptedRun& run) const {
    ASSERT_EQ(run.states.size(), 2u);
    for (const auto& [v, state] : run.states) {
      const auto& states = truth_.at(v);
      const auto after = states.lower_bound(run.time);
      ASSERT_NE(after, states.end());
      EXPECT_LE(after->first - run.time, std::chrono::milliseconds(1));  // a step
      EXPECT_EQ(state.body.p_world, after->second.body.p_world);
      EXPECT_EQ(state.body.v_world, after->second.body.v_world);
      EXPECT_EQ(state.body.q_world_body.coeffs(), after->second.body.q_world_body.coeffs());
      ASSERT_EQ(state.rotors.size(), after->second.rotors.size());
      EXPECT_EQ(state.rotors[0].speed, after->second.rotors[0].speed);
    }
  }

  TemporaryFolder folder_;
  std::int64_t now_ = 0;
  Bus bus_;
  Member member_;
  std::string killed_;
  std::map<std::size_t, std::map<SimTime, VehicleState>> truth_;
};

TEST_F(EndedRunTest, IsTheStateThatWasWrittenLast) {
  const auto run = ended();
  ASSERT_TRUE(run);
  // flushed each tenth of a second
  EXPECT_GE(run->time, SimTime(std::chrono::milliseconds(1900)));
  EXPECT_LE(run->time, SimTime(std::chrono::milliseconds(2050)));
  EXPECT_EQ(run->skipped, Duration{0});
  expect_truth(*run);
  EXPECT_FALSE(ended_run(folder_ / "none", member_.simulation, {0, 1}));
}

TEST_F(EndedRunTest, IsTheLatestInstantThatAllHave) {
  std::string text = read_file(trajectory("b"));
  for (int i = 0; i < 31; ++i) text.erase(text.find_last_of('\n'));
  write_file(trajectory("b"), text + "\n");
  const auto run = ended();
  ASSERT_TRUE(run);
  EXPECT_GT(run->time, SimTime(std::chrono::milliseconds(1000)));
  EXPECT_LT(run->time, SimTime(std::chrono::milliseconds(2000)));
  expect_truth(*run);
}

TEST_F(EndedRunTest, IsThereUntilTheNextProcessHasBegun) {
  const auto before = ended();
  ASSERT_TRUE(before);
  const auto is_the_same = [&] {
    const auto now = ended();
    return now && now->time == before->time;
  };
  {
    const FlightRecorder refused(killed_, member_.simulation, Existing::kReplace);
    EXPECT_TRUE(is_the_same());
  }
  EXPECT_TRUE(is_the_same());
  // one that was killed while it waited for the others
  fs::create_directory(staging_of(killed_));
  Member next(
      bus_, of_a_map(), {0, 1}, [this] { return now_; }, 2);
  next.simulation.resume_at(before->time, before->skipped, before->states);
  FlightRecorder recorder(killed_, next.simulation, Existing::kReplace);
  EXPECT_TRUE(is_the_same());
  next.simulation.advance_to(before->time + std::chrono::milliseconds(500), recorder);
  const auto now = ended();
  ASSERT_TRUE(now);
  EXPECT_GT(now->time, before->time);
  recorder.finish(next.simulation);
  EXPECT_FALSE(ended());
}

TEST_F(EndedRunTest, RowsThatAreCutOrNoStatesAreLeftOut) {
  const std::string text = read_file(trajectory("a"));
  const std::size_t last = text.find_last_of('\n', text.size() - 2);
  const std::string row = text.substr(last + 1);
  for (const std::string& end : {row.substr(0, row.size() / 2),
                                 std::string("1e300,") + row.substr(row.find(',') + 1),
                                 "3.5,nan" + row.substr(row.find(',', row.find(',') + 1)),
                                 std::string("nonsense\n"),
                                 std::string("1,2,3\n")}) {
    write_file(trajectory("a"), text.substr(0, last + 1) + end);
    const auto run = ended();
    ASSERT_TRUE(run) << end;
    expect_truth(*run);
  }
  write_file(trajectory("a"), "");
  EXPECT_FALSE(ended());
}

TEST_F(EndedRunTest, LinksAreNotFollowedAndWhatTheyLeadToStays) {
  fs::create_directory(folder_ / "theirs");
  const std::string theirs = folder_ / "theirs/trajectory.csv.partial";
  fs::rename(trajectory("a"), theirs);
  fs::create_symlink(theirs, trajectory("a"));
  const std::string text = read_file(theirs);
  EXPECT_FALSE(ended());
  Member next(
      bus_, of_a_map(), {0, 1}, [this] { return now_; }, 2);
  {
    FlightRecorder recorder(killed_, next.simulation, Existing::kReplace);
    next.simulation.advance_to(SimTime(std::chrono::milliseconds(10)), recorder);
    recorder.finish(next.simulation);
  }
  EXPECT_EQ(read_file(theirs), text);
  EXPECT_TRUE(fs::is_symlink(fs::path(killed_) / ".killed/a/trajectory.csv.partial"));
  const std::string other = folder_ / "other";
  fs::create_directory(other);
  fs::create_directory_symlink(folder_ / "theirs", staging_of(other));
  expect_contains(error_of([&] { FlightRecorder(other, next.simulation, Existing::kReplace); }),
                  "was not made by a run");
  EXPECT_EQ(read_file(theirs), text);
}

TEST_F(EndedRunTest, AnotherScenariosRunIsTold) {
  const auto run = ended();
  ASSERT_TRUE(run);
  EXPECT_TRUE(was_run_of(run->scenario, member_.simulation));
  const auto other = [&](const auto& change) {
    Scenario scenario = run->scenario;
    change(scenario);
    return !was_run_of(scenario, member_.simulation);
  };
  EXPECT_TRUE(other([](Scenario& s) { s.seed = 2; }));
  EXPECT_TRUE(other([](Scenario& s) { s.map_hash = "0"; }));
  EXPECT_TRUE(other([](Scenario& s) { s.vehicles[0].start.x() += 0.1; }));
  // how long it flies and what it writes is no other scenario, nor is where one begins again
  EXPECT_FALSE(other([](Scenario& s) { s.duration = 90; }));
  EXPECT_FALSE(other([](Scenario& s) { s.output.scans = !s.output.scans; }));
  EXPECT_FALSE(other([](Scenario& s) {
    ShareSetup share = share_setup_of(s);
    share.on_return = OnReturn::kLog;
    s.sections["share"] = share;
  }));
}

}  // namespace
}  // namespace pointflight
