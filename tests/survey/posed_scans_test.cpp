// Surveys on disk: which pose is which scan's, times of points, files that are wrong.
#include "pointflight/survey/posed_scans.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "pointflight/fidelity/survey.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;
using testing::TemporaryFolder;
using testing::write_file;

std::vector<SurveyRay> all_of(SurveyReader& reader) {
  std::vector<SurveyRay> all;
  std::vector<SurveyRay> batch;
  while (reader.read(batch)) all.insert(all.end(), batch.begin(), batch.end());
  return all;
}

void write_scan(const std::string& path, const std::string& rows, const std::string& time = "") {
  const auto count = std::count(rows.begin(), rows.end(), '\n');
  const bool timed = !time.empty();
  write_file(path,
             "VERSION 0.7\nFIELDS x y z" + (timed ? " " + time : "") + "\nSIZE 4 4 4" +
                 (timed ? " 8" : "") + "\nTYPE F F F" + (timed ? (time == "t" ? " U" : " F") : "") +
                 "\nCOUNT 1 1 1" + (timed ? " 1" : "") + "\nWIDTH " + std::to_string(count) +
                 "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + std::to_string(count) +
                 "\nDATA ascii\n" + rows);
}

/// Two scans, 1 m apart along x in 1 s.
struct TwoScans {
  TemporaryFolder folder;
  TwoScans() {
    std::filesystem::create_directories(folder / "scans");
    write_scan(folder / "scans/a.pcd", "3 0 0\n0 0 0\nnan 0 0\n");
    write_scan(folder / "scans/b.pcd", "0 2 0\n");
    write_file(folder / "poses.tum", "0 0 0 1 0 0 0 1\n1 1 0 1 0 0 0 1\n");
  }
  [[nodiscard]] SurveyFiles files() const {
    return {folder / "scans", folder / "poses.tum", "", false};
  }
};

TEST(SurveyFolder, MatchesScansAndPosesInOrder) {
  const TwoScans two;
  const SurveyFolder survey(two.files());
  EXPECT_EQ(survey.scan_count(), 2u);
  const auto rays = all_of(*survey.open());
  ASSERT_EQ(rays.size(), 2u) << "the sensor itself and NaN are no returns";
  EXPECT_EQ(rays[0].origin_world, Vector3d(0, 0, 1));
  EXPECT_EQ(rays[0].direction_world, Vector3f(1, 0, 0));
  EXPECT_EQ(rays[0].range, 3.0f);
  EXPECT_TRUE(rays[1].point_world().isApprox(Vector3d(1, 2, 1)));
  const auto second = all_of(*survey.open([](std::size_t scan) { return scan == 1; }));
  ASSERT_EQ(second.size(), 1u);
  EXPECT_EQ(second[0].origin_world, Vector3d(1, 0, 1));
}

TEST(SurveyFolder, TheNinthColumnNamesTheScan) {
  const TwoScans two;
  write_file(two.folder / "poses.tum", "0 0 0 1 0 0 0 1 b.pcd\n1 1 0 1 0 0 0 1 a.pcd\n");
  const auto rays = all_of(*SurveyFolder(two.files()).open());
  EXPECT_EQ(rays[0].range, 2.0f);
  EXPECT_EQ(rays[1].origin_world.x(), 1.0);
}

TEST(SurveyFolder, PointsWithTimesGetPosesBetween) {
  const TwoScans two;
  for (const auto& [field, unit] : {std::pair{"time", 1.0}, {"t", 1e9}, {"timestamp", 1.0}}) {
    SCOPED_TRACE(field);
    write_scan(two.folder / "scans/a.pcd",
               fmt::format("3 0 0 0\n3 0 0 {}\n3 0 0 {}\n", 0.25 * unit, 0.5 * unit),
               field);
    // beyond the last pose it goes on as before
    write_scan(two.folder / "scans/b.pcd", fmt::format("3 0 0 {}\n", 0.5 * unit), field);
    const auto rays = all_of(*SurveyFolder(two.files()).open());
    ASSERT_EQ(rays.size(), 4u);
    EXPECT_NEAR(rays[0].origin_world.x(), 0.0, 1e-9);
    EXPECT_NEAR(rays[1].origin_world.x(), 0.25, 1e-9);
    EXPECT_NEAR(rays[2].origin_world.x(), 0.5, 1e-9);
    EXPECT_NEAR(rays[3].origin_world.x(), 1.5, 1e-9);
    SurveyFiles deskewed = two.files();
    deskewed.is_deskewed = true;
    EXPECT_EQ(all_of(*SurveyFolder(deskewed).open())[2].origin_world.x(), 0.0);
  }
}

TEST(TimeUnit, IsTheOneInWhichAScanTakesWhatItShould) {
  EXPECT_STREQ(unit_by_span(0.0997, 0.1)->name, "s");
  EXPECT_STREQ(unit_by_span(99.7, 0.1)->name, "ms");
  EXPECT_STREQ(unit_by_span(99700, 0.1)->name, "us");
  EXPECT_STREQ(unit_by_span(99.7e6, 0.1)->name, "ns");
  EXPECT_STREQ(unit_by_span(10e6, 0.1)->name, "ns") << "a camera's shutter";
  EXPECT_STREQ(unit_by_span(100e6, 1.0)->name, "ns") << "key frames";
  EXPECT_EQ(unit_by_span(1e15, 0.1), std::nullopt);
  EXPECT_EQ(unit_by_span(0.0, 0.1), std::nullopt);
}

/// Five scans, 1 m and 1 s apart along x, whose second point is measured half a second after the
/// first; `unit` s is what their times are in.
struct FiveScans {
  TemporaryFolder folder;
  FiveScans(const char* field, double unit) {
    std::filesystem::create_directories(folder / "scans");
    std::string poses;
    for (int i = 0; i < 5; ++i) {
      write_scan(folder / fmt::format("scans/{}.pcd", i),
                 fmt::format("3 0 0 0\n3 0 0 {:.0f}\n", 0.5 / unit),
                 field);
      poses += fmt::format("{} {} 0 1 0 0 0 1\n", i, i);
    }
    write_file(folder / "poses.tum", poses);
  }
  [[nodiscard]] SurveyFiles files() const { return {folder / "scans", folder / "poses.tum", ""}; }
};

TEST(SurveyFolder, RecognisesTheUnitOfTimes) {
  // t is whole and taken for ns, time is a float and taken for s
  for (const auto& [field, unit, said] : {std::tuple{"t", 1e-9, ""},
                                          {"t", 1e-6, "taken to be in us"},
                                          {"time", 1e-3, "taken to be in ms"},
                                          {"time", 1e-6, "taken to be in us"},
                                          {"time", 1e-9, "taken to be in ns"}}) {
    SCOPED_TRACE(fmt::format("{} {}", field, unit));
    const FiveScans scans(field, unit);
    const SurveyFolder survey(scans.files());
    if (*said == '\0') {
      EXPECT_EQ(survey.about_times(), "");
    } else {
      expect_contains(survey.about_times(), said);
    }
    const auto rays = all_of(*survey.open());
    ASSERT_EQ(rays.size(), 10u);
    EXPECT_NEAR(rays[5].origin_world.x(), 2.5, 1e-6);
  }
  const FiveScans scans("t", 1e-6);
  SurveyFiles files = scans.files();
  files.time_unit = kTimeUnits[3];
  const SurveyFolder told(files);
  expect_contains(told.about_times(), "taken to be in ns: a scan takes 0.0005 s so");
  EXPECT_NEAR(all_of(*told.open())[5].origin_world.x(), 2.0005, 1e-6) << "the user's word counts";
}

TEST(SurveyFolder, SaysWhereNothingTellsTheTimes) {
  const FiveScans scans("label", 1.0);
  expect_contains(SurveyFolder(scans.files()).about_times(), "its points have no times");
  SurveyFiles deskewed = scans.files();
  deskewed.is_deskewed = true;
  EXPECT_EQ(SurveyFolder(deskewed).about_times(), "");
}

TEST(SurveyFolder, PosesFarApartSayNothingOfMotionWithinAScan) {
  const TwoScans two;
  write_file(two.folder / "poses.tum", "0 0 0 1 0 0 0 1\n60 1 0 1 0 0 0 1\n");
  write_scan(two.folder / "scans/a.pcd", "3 0 0 0\n3 0 0 0.1\n", "time");
  const auto rays = all_of(*SurveyFolder(two.files()).open());
  EXPECT_EQ(rays[0].origin_world.x(), 0.0);
  EXPECT_EQ(rays[1].origin_world.x(), 0.0);
}

TEST(SurveyFolder, TimesMayBeSince1970) {
  const TwoScans two;
  // as Livox' driver writes them: nanoseconds in a double
  write_file(two.folder / "poses.tum", "1700000000 0 0 1 0 0 0 1\n1700000001 1 0 1 0 0 0 1\n");
  write_scan(two.folder / "scans/a.pcd", "3 0 0 1700000000500000000\n", "timestamp");
  EXPECT_NEAR(all_of(*SurveyFolder(two.files()).open())[0].origin_world.x(), 0.5, 1e-6);
}

TEST(SurveyFolder, ReadsKittiPoses) {
  const TwoScans two;
  write_file(two.folder / "poses.txt", "0 -1 0 5 1 0 0 6 0 0 1 7\n1 0 0 0 0 1 0 0 0 0 1 0\n");
  SurveyFiles files = two.files();
  files.poses = two.folder / "poses.txt";
  const auto rays = all_of(*SurveyFolder(files).open());
  EXPECT_TRUE(rays[0].point_world().isApprox(Vector3d(5, 9, 7), 1e-6)) << "turned by 90 degrees";
}

TEST(SurveyFolder, NumbersAreOrderedBySizeAndNanIsAWord) {
  const TwoScans two;
  std::filesystem::rename(two.folder / "scans/a.pcd", two.folder / "scans/10.pcd");
  std::filesystem::rename(two.folder / "scans/b.pcd", two.folder / "scans/9.pcd");
  EXPECT_EQ(all_of(*SurveyFolder(two.files()).open())[0].range, 2.0f) << "9 before 10";
  std::filesystem::rename(two.folder / "scans/9.pcd", two.folder / "scans/nan.pcd");
  EXPECT_EQ(all_of(*SurveyFolder(two.files()).open())[0].range, 3.0f) << "10 before nan, as text";
}

TEST(SurveyFolder, NamesAreTimesOfATrajectory) {
  const TwoScans two;
  std::filesystem::rename(two.folder / "scans/a.pcd", two.folder / "scans/0.25.pcd");
  std::filesystem::rename(two.folder / "scans/b.pcd", two.folder / "scans/0.50.pcd");
  write_file(two.folder / "poses.tum", "0 0 0 1 0 0 0 1\n0.5 0.5 0 1 0 0 0 1\n1 1 0 1 0 0 0 1\n");
  const auto rays = all_of(*SurveyFolder(two.files()).open());
  EXPECT_NEAR(rays[0].origin_world.x(), 0.25, 1e-9);
  EXPECT_NEAR(rays[1].origin_world.x(), 0.5, 1e-9);
}

TEST(SurveyFolder, WhatIsWrongIsSaidInOneLine) {
  const TwoScans two;
  const auto error = [&](const std::string& poses) {
    write_file(two.folder / "poses.tum", poses);
    return error_of([&] { (void)SurveyFolder(two.files()); });
  };
  expect_contains(error("0 0 0 1 0 0 0 1\n"), "1 poses for 2 scans");
  expect_contains(error("1 0 0 1 0 0 0 1\n0 0 0 1 0 0 0 1\n"), "pose 2 is not later");
  expect_contains(error("0 0 0 1 0 0 0 1 a.pcd\n1 0 0 1 0 0 0 1\n"), "1 of 2 poses name");
  expect_contains(error("1e99 0 0 1 0 0 0 1\n2e99 0 0 1 0 0 0 1\n"), "is no time");
  expect_contains(error("1 0 0 0 0 1 0 0 0 0 2 0\n"), ":1: the first three columns");
  expect_contains(error("1 0 0 0 0 1 0 0 0 0 x 0\n"), "'x' is no number");
  write_file(two.folder / "poses.tum", "0 0 0 1 0 0 0 1 a.pcd\n1 0 0 1 0 0 0 1 gone.pcd\n");
  expect_contains(error_of([&] { all_of(*SurveyFolder(two.files()).open()); }), "gone.pcd");
  SurveyFiles files = two.files();
  files.scans = two.folder / "nowhere";
  write_file(two.folder / "poses.tum", "0 0 0 1 0 0 0 1\n");
  expect_contains(error_of([&] { (void)SurveyFolder(files); }), "nowhere");
  std::filesystem::create_directories(two.folder / "empty");
  files.scans = two.folder / "empty";
  expect_contains(error_of([&] { (void)SurveyFolder(files); }), "no clouds");
}

TEST(SurveyFolder, ReadsBackASurveyThatWasWritten) {
  ExactScene scene;
  scene.name = "yard";
  scene.geometry.add_rectangle({0, 0, 0}, {12, 0, 0}, {0, 8, 0});
  scene.geometry.add_rectangle({0, 8, 0}, {12, 0, 0}, {0, 0, 3});
  scene.tag_from(0, "wall");
  const SceneTree tree(scene);
  const Executor executor(2);
  SurveyOptions options;
  options.seconds = 1.0;
  const Survey survey = make_survey(scene, tree, load_lidar("mid360"), options, executor);
  const TemporaryFolder folder;
  write_survey(survey, folder.path());
  const SurveyFolder read({folder / "scans", folder / "poses.tum", folder / "free", false});
  auto rays = all_of(*read.open());
  auto truth = all_of(*rays_of(survey));
  ASSERT_EQ(rays.size(), truth.size());
  const auto before = [](const SurveyRay& a, const SurveyRay& b) {
    return a.is_return > b.is_return;
  };
  std::size_t first = 0;
  for (const auto& scan : survey.scans) {  // on disk the returns of a scan come first
    std::stable_sort(truth.begin() + static_cast<std::ptrdiff_t>(first),
                     truth.begin() + static_cast<std::ptrdiff_t>(first + scan.size()),
                     before);
    first += scan.size();
  }
  for (std::size_t i = 0; i < rays.size(); ++i) {
    ASSERT_EQ(rays[i].is_return, truth[i].is_return);
    ASSERT_LT((rays[i].origin_world - truth[i].origin_world).norm(), 1e-6);
    ASSERT_LT((rays[i].direction_world - truth[i].direction_world).norm(), 1e-6f);
    ASSERT_NEAR(rays[i].range, truth[i].range, 1e-4);
  }
}

}  // namespace
}  // namespace pointflight
