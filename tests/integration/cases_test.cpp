// Inputs that failed once, from the shared cases: each with the right value or the right sentence.
#include <nlohmann/json.hpp>

#include "pointflight/map/surfel_map.hpp"
#include "tests/integration/program.hpp"

namespace pointflight::testing {
namespace {

struct Case {
  const char* file;
  const char* said;  ///< On stderr, or nothing.
  Vector3d size;     ///< Of the map, m.
  bool has_intensity = false;
  const char* flags = "";
};

// the hall of these files is 10 x 8 x 3 m
const Vector3d kHall(10, 8, 3);
const Vector3d kFloor(10, 8, 0);
const Case kCases[] = {
    {"pcd_utm_float32.pcd", "stored in steps of 0.5 m", kHall},
    {"utm_f64.pcd", "", kHall},
    {"pcd_one_saturated_intensity.pcd", "brighter ones are kept in coarse steps", kHall, true},
    {"pcd_intensity_other_names_Intensity.pcd", "intensity from 'Intensity'", kHall, true},
    {"pcd_lower_case_types.pcd", "", kHall},
    {"pcd_upper_case_fields.pcd", "", kHall},
    {"txt_xyzrgbi.txt", "read as x y z red green blue intensity", kHall, true},
    {"kitti_velodyne.bin", "KITTI", kHall, true},
    {"ply_tristrip.ply", "", kFloor},
    {"ply_comment_in_vertex.ply", "", kHall},
    {"obj_vt_named_but_absent.obj", "", kFloor},
    {"obj_points_only.obj", "its vertices are read as points", {10, 10, 10}},
    {"obj_utm.obj", "", kFloor, false, "--shift -500000,-5000000,-300"},
    {"dae_y_up.dae", "y is up; --up y turns it", {10, 3, 8}},
    {"dae_y_up.dae", "", kHall, false, "--up y"},
};

TEST(Cases, FilesAsPeopleHaveThem) {
  const TemporaryFolder folder;
  for (const Case& c : kCases) {
    SCOPED_TRACE(c.file);
    const std::string path = shared_data(std::string("../cases/imports/") + c.file);
    SKIP_WITHOUT(path);
    const std::string map = folder / "a.pfmap";
    const Result result = run(fmt::format("map import {} -o {} --force {}", path, map, c.flags));
    ASSERT_EQ(result.code, 0) << result.err;
    expect_contains(result.err, c.said);
    if (*c.said == '\0') {
      EXPECT_EQ(result.err.find("warning"), std::string::npos) << result.err;
    }
    const auto opened = SurfelMap::open(map);
    EXPECT_LT((opened->bounds_world().size() - c.size).cwiseAbs().maxCoeff(), 0.7) << result.err;
    EXPECT_EQ(opened->has_intensity(), c.has_intensity);
  }
}

TEST(Cases, TimesOfPointsInRecordings) {
  const TemporaryFolder folder;
  for (const auto& [file, said] : {std::pair{"recording_times_us_uint32.mcap", "taken to be in us"},
                                   {"recording_without_times.mcap", "its points have no times"}}) {
    SCOPED_TRACE(file);
    const std::string packed = shared_data(fmt::format("../cases/imports/{}.xz", file));
    SKIP_WITHOUT(packed);
    const std::string path = folder / file;
    ASSERT_EQ(std::system(fmt::format("xz -dkc {} > {}", packed, path).c_str()), 0);
    const Result result = run(fmt::format(
        "map import --scans {} --resolution 0.1 -o {} --force", path, folder / "a.pfmap"));
    ASSERT_EQ(result.code, 0) << result.err;
    expect_contains(result.err, said);
  }
}

TEST(Cases, AFlightInUtmHasAFrameForItsClouds) {
  const std::string cases = shared_data("../cases/imports");
  SKIP_WITHOUT(cases);
  const TemporaryFolder folder;
  std::filesystem::copy_file(cases + "/utm_flight.yaml", folder / "utm_flight.yaml");
  ASSERT_EQ(
      run(fmt::format("map import {}/utm_f64.pcd -o {}", cases, folder / "utm_f64.pfmap")).code, 0);
  const Result flown = run(fmt::format("fly {} -o {} --record {} --duration 0.3 --no-picture",
                                       folder / "utm_flight.yaml",
                                       folder / "run",
                                       folder / "run.mcap"));
  EXPECT_EQ(flown.code, 0) << flown.err;
  expect_contains(flown.err, "clouds in the world are in frame map, whose zero is at 836400,4818");
}

TEST(Cases, StartsAndKeysAndKinds) {
  const std::string cases = shared_data("../cases/imports");
  SKIP_WITHOUT(cases);
  const TemporaryFolder folder;
  const auto import = [&](const char* file, const char* map) {
    ASSERT_EQ(run(fmt::format("map import {}/{} -o {}", cases, file, folder / map)).code, 0);
  };
  import("room.pcd", "room.pfmap");
  import("pillars_without_ground.pcd", "pillars.pfmap");
  expect_contains(
      run(fmt::format(
              "fly {} -o {} --start 10,4,1.5 --duration 2", folder / "room.pfmap", folder / "r"))
          .err,
      "0.26 m inside the map");
  const Result flown = run(fmt::format(
      "fly {} -o {} --start 2,0,1 --duration 2", folder / "pillars.pfmap", folder / "p"));
  expect_contains(flown.out, "flown");
  const Result made =
      run(fmt::format("scenario new {} -o {}", folder / "pillars.pfmap", folder / "pillars.yaml"));
  EXPECT_EQ(made.code, 0) << made.err;
  expect_contains(made.err, "the map has no ground");
  expect_user_error(run(fmt::format("scenario check {}/vehicle_with_mission.yaml", cases)),
                    "stands beside it");
  expect_user_error(run(fmt::format("fly {}/room.pcd -o {}", cases, folder / "x")), "map import");
  expect_user_error(run(fmt::format("map import {}/room.pcd -o {}", cases, folder / "out.pcd")),
                    "out.pfmap");
}

}  // namespace
}  // namespace pointflight::testing
