#include "pointflight/lidar/lidar.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/io/cloud_reader.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::map_of;

LidarSettings exact_lidar(const std::string& name) {
  LidarSettings settings = load_lidar(name);
  settings.noise = {};
  return settings;
}

TEST(Lidar, Statistics_AScanTakenWhileFlyingUsesThePoseOfEachBeam) {
  // 5 m/s along x and 180 deg/s of yaw inside a box
  ShapeScene scene;
  scene.add_box({-6, -6, -2}, {6, 6, 4});
  const auto map = map_of(scene, 0.05);
  const auto renderer = make_renderer("beam", Scene{map});
  const Lidar lidar(exact_lidar("mid360"), 0);
  std::vector<TimedPose> poses;
  for (int ms = 0; ms <= 100; ++ms) {
    const double s = 1e-3 * ms;
    poses.push_back({SimTime(std::chrono::milliseconds(ms)),
                     {quaternion_from_rpy(0, 0, kPi * s), {5.0 * s, 0, 0}}});
  }
  const PoseTrack moving(poses);
  const Executor executor(2);
  ScanRequest request;
  const Scan scan = lidar.take(request, moving, *renderer, executor);
  EXPECT_GT(scan.points.size(), 19000u);
  const auto off_wall = [](const Vector3d& p) {
    return std::min({std::abs(std::abs(p.x()) - 6),
                     std::abs(std::abs(p.y()) - 6),
                     std::abs(p.z() + 2),
                     std::abs(p.z() - 4)});
  };
  double worst = 0.0;
  double mean_own = 0.0;
  double mean_snapshot = 0.0;
  for (const ScanPoint& point : scan.points) {
    // each point at its own time lies on the box; all at one time, they do not
    const Vector3d p = point.position_sensor.cast<double>();
    const double own = off_wall(moving.at(scan.start + point.time_offset) * p);
    worst = std::max(worst, own);
    mean_own += own / static_cast<double>(scan.points.size());
    mean_snapshot += off_wall(moving.at(scan.start) * p) / static_cast<double>(scan.points.size());
  }
  EXPECT_LT(worst, 0.06);
  EXPECT_LT(mean_own, 0.003);
  EXPECT_GT(mean_snapshot, 0.1);
  // the paper's way: one pose
  request.snapshot = true;
  double mean_one_pose = 0.0;
  const Scan one_pose = lidar.take(request, moving, *renderer, executor);
  const Pose middle = moving.at(one_pose.start + lidar.period() / 2);
  for (const ScanPoint& point : one_pose.points) {
    mean_one_pose += off_wall(middle * point.position_sensor.cast<double>()) /
                     static_cast<double>(one_pose.points.size());
  }
  EXPECT_LT(mean_one_pose, 0.003);
}

/// Mean of measured minus true range by ring, m.
std::vector<double> ring_errors(const LidarSettings& settings, std::uint64_t seed, bool as_lines) {
  static const auto renderer = [] {
    ShapeScene scene;
    scene.add_box({-6, -6, -2}, {6, 6, 4});
    return make_renderer("beam", Scene{map_of(scene, 0.1)});
  }();
  LidarSettings chosen = settings;
  if (as_lines) chosen.optics.sub_rays = 1;
  const Lidar lidar(chosen, 0, nullptr, Surroundings{});
  ScanRequest request;
  request.seed = seed;
  request.truth = true;
  const Scan scan = lidar.take(request, PoseTrack(Pose{}), *renderer, Executor(2));
  std::vector<double> sums;
  std::vector<double> counts;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    if (scan.truth[i].sub_rays == 0) continue;
    const std::size_t ring = scan.points[i].ring;
    sums.resize(std::max(sums.size(), ring + 1));
    counts.resize(sums.size());
    sums[ring] += static_cast<double>(scan.points[i].range - scan.truth[i].range);
    counts[ring] += 1.0;
  }
  for (std::size_t ring = 0; ring < sums.size(); ++ring) {
    if (counts[ring] > 0.0) sums[ring] /= counts[ring];
  }
  return sums;
}

TEST(Lidar, Statistics_OffsetsAreDrawnOnceForEachRingAndRun) {
  LidarSettings settings = load_lidar("vlp16");
  settings.noise = {};
  settings.noise.ring_offset_sigma = 0.02;
  const auto first = ring_errors(settings, 1, false);
  ASSERT_EQ(first.size(), 16u);
  double square = 0.0;
  double whole = 0.0;
  double runs = 0.0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    settings.noise.offset_sigma = 0.0;
    const auto errors = ring_errors(settings, seed, true);
    for (const double error : errors) square += error * error / (20.0 * 16.0);
    settings.noise.offset_sigma = 0.05;
    const auto moved = ring_errors(settings, seed, true);
    for (std::size_t ring = 1; ring < 16; ++ring) {
      EXPECT_NEAR(moved[ring] - errors[ring], moved[0] - errors[0], 1e-5);
    }
    whole += std::pow(moved[0] - errors[0], 2) / 20.0;
    runs += 1.0;
  }
  EXPECT_EQ(runs, 20.0);
  EXPECT_NEAR(std::sqrt(square), 0.02, 0.002);
  EXPECT_NEAR(std::sqrt(whole), 0.05, 0.02);
  // wide beams and lines are off by the same
  settings.noise.offset_sigma = 0.0;
  const auto lines = ring_errors(settings, 1, true);
  for (std::size_t ring = 0; ring < 16; ++ring) EXPECT_NEAR(first[ring], lines[ring], 1e-5);
  // no noise, no offsets
  settings.noise = {};
  for (const double error : ring_errors(settings, 1, true)) EXPECT_NEAR(error, 0.0, 1e-5);
}

/// Share of a D455's pixels that see a wall across its axis at `depth`; their depths are checked.
double share_of_pixels(double depth, bool noise) {
  ShapeScene scene;
  scene.add_box({depth, -12, -12}, {depth + 0.4, 12, 12});
  const auto map = map_of(scene, 0.1);
  const auto renderer = make_renderer("beam", Scene{map});
  const Lidar camera(load_lidar("d455"), 0);
  ScanRequest request;
  request.noise = noise;
  const PoseTrack still;
  const Scan scan = camera.take(request, still, *renderer, Executor(2));
  double sum = 0.0;
  double squares = 0.0;
  const auto count = static_cast<double>(scan.points.size());
  for (const ScanPoint& point : scan.points) {
    const double off = static_cast<double>(point.position_sensor.x()) - depth;
    sum += off;
    squares += off * off;
  }
  if (count > 0.0) {
    EXPECT_NEAR(sum / count, 0.0, 0.01);
    // stereo: the deviation of the depth grows with its square, in the corners as in the middle
    EXPECT_NEAR(std::sqrt(squares / count), noise ? 0.00214 * depth * depth : 0.0, 0.01);
  }
  return count / static_cast<double>(scan.beams);
}

TEST(Lidar, Statistics_ADepthCamerasLimitsAreOfTheDepthAlongItsAxis) {
  for (const bool noise : {false, true}) {
    EXPECT_GT(share_of_pixels(5.0, noise), 0.9999);
    EXPECT_GT(share_of_pixels(5.9, noise), 0.9999);
    EXPECT_EQ(share_of_pixels(6.1, noise), 0.0);
    EXPECT_GT(share_of_pixels(0.65, noise), 0.9999);
    EXPECT_EQ(share_of_pixels(0.55, noise), 0.0);
  }
}

TEST(Lidar, RangeNoiseHasTheFilesDeviationAndNoBias) {
  ShapeScene scene;
  scene.add_box({-6, -6, -2}, {6, 6, 4});
  const auto renderer = make_renderer("beam", Scene{map_of(scene, 0.1)});
  LidarSettings settings = load_lidar("mid360");
  settings.noise.range_sigma = 0.03;
  const Lidar noisy(settings, 0);
  const Lidar exact(exact_lidar("mid360"), 0);
  const PoseTrack still;
  const Executor executor(2);
  ScanRequest request;
  request.seed = 5;
  const Scan a = noisy.take(request, still, *renderer, executor);
  const Scan b = exact.take(request, still, *renderer, executor);
  ASSERT_EQ(a.points.size(), b.points.size());
  double mean = 0.0;
  double square = 0.0;
  const auto n = static_cast<double>(a.points.size());
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    const double e = static_cast<double>(a.points[i].range - b.points[i].range);
    mean += e / n;
    square += e * e / n;
  }
  EXPECT_NEAR(mean, 0.0, 5 * 0.03 / std::sqrt(n));
  EXPECT_NEAR(std::sqrt(square), 0.03, 5 * 0.03 / std::sqrt(2 * n));
  // another seed, other noise; the same seed, the same bytes
  EXPECT_EQ(noisy.take(request, still, *renderer, executor).points[7].range, a.points[7].range);
  request.seed = 6;
  EXPECT_NE(noisy.take(request, still, *renderer, executor).points[7].range, a.points[7].range);
  request.noise = false;
  EXPECT_EQ(noisy.take(request, still, *renderer, executor).points[7].range, b.points[7].range);
}

TEST(Lidar, DropsReturnsNearerThanItsMinimum) {
  ShapeScene scene;
  scene.add_rectangle({0.5, -3, -3}, {0, 6, 0}, {0, 0, 6});
  const auto renderer = make_renderer("beam", Scene{map_of(scene, 0.05)});
  const Executor executor(1);
  const PoseTrack still;
  const Lidar avia(exact_lidar("avia"), 0);  // from 1 m
  for (const ScanPoint& p : avia.take({}, still, *renderer, executor).points) {
    EXPECT_GE(p.range, 1.0f);
  }
}

TEST(Lidar, SharedBeamsGiveTheSameScans) {
  ShapeScene scene;
  scene.add_box({-6, -6, -2}, {6, 6, 4});
  const auto renderer = make_renderer("beam", Scene{map_of(scene, 0.2)});
  const PoseTrack still;
  const Executor executor(2);
  for (const char* model : {"mid360", "os1_32"}) {
    const LidarSettings settings = load_lidar(model);
    const auto beams = std::make_shared<const ScanBeams>(settings);
    const Lidar first(settings, 0, beams);
    const Lidar second(settings, 1, beams);
    const Lidar alone(settings, 1);
    // in any order, also of scans that are not kept any more
    for (const std::uint64_t index : {0u, 5u, 2u, 3u, 0u, 3u}) {
      ScanRequest request;
      request.index = index;
      EXPECT_GT(first.take(request, still, *renderer, executor).points.size(), 0u);
      const Scan shared = second.take(request, still, *renderer, executor);
      const Scan own = alone.take(request, still, *renderer, executor);
      ASSERT_EQ(shared.points.size(), own.points.size()) << model;
      for (std::size_t i = 0; i < own.points.size(); ++i) {
        ASSERT_EQ(shared.points[i].range, own.points[i].range);
        ASSERT_EQ(shared.points[i].beam, own.points[i].beam);
        ASSERT_EQ(shared.points[i].time_offset, own.points[i].time_offset);
      }
    }
  }
}

TEST(Lidar, AsLinesIsTheSensorWithOneSubRay) {
  ShapeScene scene;
  scene.add_box({-6, -6, -2}, {6, 6, 4});
  scene.add_box({2, -0.5, -1}, {2.5, 0.5, 1});
  const auto renderer = make_renderer("beam", Scene{map_of(scene, 0.2)});
  const Executor executor(2);
  LidarSettings settings = load_lidar("os1_32");
  const Lidar wide(settings, 0, nullptr, Surroundings{});
  settings.optics.sub_rays = 1;
  const Lidar line(settings, 0, nullptr, Surroundings{});
  const auto ranges = [&](const Lidar& lidar) {
    std::vector<float> all;
    for (const ScanPoint& point : lidar.take({}, PoseTrack(), *renderer, executor).points) {
      all.push_back(point.range);
    }
    return all;
  };
  EXPECT_EQ(ranges(wide.as_lines()), ranges(line));
  EXPECT_NE(ranges(wide), ranges(line));
}

TEST(Lidar, MarksWhatCameThroughSpaceThatNoSurveySaw) {
  ShapeScene scene;
  scene.add_box({-6, -6, -2}, {6, 6, 4});
  const auto renderer = make_renderer("beam", Scene{map_of(scene, 0.1)});
  const Lidar lidar(exact_lidar("mid360"), 0);
  Aabb box;
  box.add({-7, -7, -3});
  box.add({7, 7, 5});
  KnownSpaceBuilder builder(box, 0.1, 1000000);
  builder.add([](const Vector3d& p) { return p.y() < 0.0; });  // half of the room
  const auto section = builder.section();
  const auto known = KnownSpace::from_section(section);
  ScanRequest request;
  const PoseTrack still(Pose{Quaterniond::Identity(), {0.0, -1.0, 0.0}});
  const Scan plain = lidar.take(request, still, *renderer, Executor(2));
  request.known = &*known;
  const Scan marked = lidar.take(request, still, *renderer, Executor(2));
  EXPECT_FALSE(plain.marks.unknown);
  EXPECT_TRUE(marked.marks.unknown);
  ASSERT_EQ(marked.points.size(), plain.points.size());
  std::size_t unknown = 0;
  for (std::size_t i = 0; i < marked.points.size(); ++i) {
    EXPECT_EQ(marked.points[i].range, plain.points[i].range);
    const float y = marked.points[i].position_sensor.y() - 1.0f;
    unknown += marked.points[i].is_unknown ? 1 : 0;
    const bool is_beside = y > -0.1f && y < 0.3f;
    EXPECT_TRUE(is_beside || marked.points[i].is_unknown == (y > 0.0f)) << y;
  }
  EXPECT_GT(unknown, marked.points.size() / 5);
  // in files, and back
  const testing::TemporaryFolder folder;
  write_scan_pcd(folder / "s.pcd", marked);
  testing::expect_contains(testing::read_file(folder / "s.pcd"), "ring label unknown\n");
  const auto beams = lidar.beams(0, Executor(1));
  Scan read;
  read.marks.unknown = true;
  read_scan_points(folder / "s.pcd", beams, {}, read);
  const std::vector<ScanPoint>& back = read.points;
  ASSERT_EQ(back.size(), marked.points.size());
  for (std::size_t i = 0; i < back.size(); ++i) {
    EXPECT_EQ(back[i].is_unknown, marked.points[i].is_unknown);
  }
  Scan unmarked;
  testing::expect_contains(
      testing::error_of([&] { read_scan_points(folder / "s.pcd", beams, {}, unmarked); }),
      "no scan");
}

/// A box of 12 x 12 x 6 m around the origin.
ShapeScene room() {
  ShapeScene scene;
  scene.add_box({-6, -6, -2}, {6, 6, 4});
  return scene;
}

TEST(Lidar, Statistics_TruthIsWhatIsThereAndWhereExactDeskewingPutsThePoint) {
  const ShapeScene scene = room();
  const auto map = map_of(scene, 0.05);
  const auto renderer = make_renderer("beam", Scene{map});
  std::vector<TimedPose> poses;
  for (int ms = 0; ms <= 200; ++ms) {
    const double s = 1e-3 * ms;
    poses.push_back({SimTime(std::chrono::milliseconds(ms)),
                     {quaternion_from_rpy(0.3 * s, 0, kPi * s), {3.0 * s, 0.5, 0}}});
  }
  const PoseTrack moving(poses);
  LidarSettings lines = load_lidar("mid360");
  lines.optics.sub_rays = 1;
  for (const bool ideal : {false, true}) {
    const Lidar lidar(
        lines, 0, nullptr, ideal ? std::nullopt : std::optional<Surroundings>(Surroundings{}));
    ScanRequest request;
    request.start = SimTime(std::chrono::milliseconds(50));
    const Scan plain = lidar.take(request, moving, *renderer, Executor(2));
    request.truth = true;
    const Scan scan = lidar.take(request, moving, *renderer, Executor(2));
    EXPECT_TRUE(plain.truth.empty());
    ASSERT_EQ(scan.truth.size(), scan.points.size());
    ASSERT_EQ(plain.points.size(), scan.points.size());
    const Pose T_world_start = moving.at(scan.start);
    double squares = 0.0;
    std::size_t looked_at = 0;
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      const ScanPoint& point = scan.points[i];
      const PointTruth& truth = scan.truth[i];
      EXPECT_EQ(point.range, plain.points[i].range);
      const Vector3d p = point.position_sensor.cast<double>();
      const Pose T_world_sensor = moving.at(scan.seen_at(point));
      // float32 of some metres
      EXPECT_LT((T_world_start * truth.deskewed.cast<double>() - T_world_sensor * p).norm(), 5e-6);
      if (point.label == kFalseReturn) {
        EXPECT_EQ(truth.sub_rays, 0);
        continue;
      }
      EXPECT_EQ(truth.sub_rays, 1);
      const Vector3d direction = T_world_sensor.rotation * p.normalized();
      const auto range = scene.intersect(T_world_sensor.translation, direction);
      ASSERT_TRUE(range);
      const Vector3d place = T_world_sensor.translation + *range * direction;
      // the map rounds corners, and its beams go 0.1 degrees off if returns are modelled
      const Vector3d q = (place - Vector3d(0, 0, 1)).cwiseAbs().cwiseQuotient(Vector3d(6, 6, 3));
      const Vector3d apart = (Vector3d::Ones() - q).cwiseProduct(Vector3d(6, 6, 3));
      int axis = 0;  // of the face
      const double nearest = apart.minCoeff(&axis);
      if (apart.sum() - apart.maxCoeff() - nearest < 0.25) continue;
      ++looked_at;
      const double cosine = std::abs(direction[axis]);
      const double blur = ideal ? 0.0 : 5.0 * 0.075 * kDegree * *range * std::sqrt(2.0);
      EXPECT_NEAR(truth.range, *range, 0.01 / cosine + blur / cosine) << i;
      EXPECT_NEAR(truth.incidence, std::acos(cosine), 0.06) << i;
      EXPECT_EQ(truth.depth, 0.0f);
      const double error = static_cast<double>(point.range) - static_cast<double>(truth.range);
      squares += error * error;
      ASSERT_LT(truth.surfel, map->words().size());
    }
    EXPECT_GT(looked_at, 9 * scan.points.size() / 10);
    EXPECT_NEAR(std::sqrt(squares / static_cast<double>(looked_at)), 0.02, 0.001);
    // what its file has, with each other mark
    const testing::TemporaryFolder folder;
    write_scan_pcd(folder / "s.pcd", scan);
    Scan read;
    read.marks = scan.marks;
    read.start = scan.start;
    read_scan_points(
        folder / "s.pcd", lidar.beams(lidar.pattern_scan(0, 0), Executor(1)), {}, read);
    ASSERT_EQ(read.truth.size(), scan.truth.size());
    for (std::size_t i = 0; i < read.truth.size(); ++i) {
      EXPECT_EQ(read.truth[i].range, scan.truth[i].range);
      EXPECT_EQ(read.truth[i].incidence, scan.truth[i].incidence);
      EXPECT_EQ(read.truth[i].deskewed, scan.truth[i].deskewed);
      EXPECT_EQ(read.truth[i].surfel, scan.truth[i].surfel);
    }
  }
}

TEST(Lidar, Statistics_TruthOfWideBeamsSaysWhatIsMixed) {
  // a pillar before a wall 3 m behind it: an OS1's beams that graze its edges see both
  ShapeScene scene;
  scene.add_box({-12, -12, -3}, {12, 12, 5});
  scene.add_box({8, -0.5, -3}, {8.3, 0.5, 5});
  const auto renderer = make_renderer("beam", Scene{map_of(scene, 0.05)});
  LidarSettings os1 = load_lidar("os1_64");
  os1.optics.pulse_ns = 30.0;  // 4.5 m: one pulse
  const Lidar lidar(os1, 0, nullptr, Surroundings{});
  ScanRequest request;
  request.truth = true;
  const Scan scan = lidar.take(request, PoseTrack(Pose{}), *renderer, Executor(2));
  std::size_t mixed = 0;
  std::size_t other_sub_rays = 0;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const PointTruth& truth = scan.truth[i];
    other_sub_rays += truth.sub_ray > 0 ? 1 : 0;
    if (truth.depth < 2.0f) continue;
    ++mixed;
    EXPECT_GT(truth.sub_rays, 1);
    EXPECT_LT(truth.sub_ray, 288);
    // the mean of both lies between them
    EXPECT_GT(truth.range, 7.9f);
  }
  EXPECT_GT(mixed, 64u);
  EXPECT_GT(other_sub_rays, mixed / 4);
}

TEST(Scan, PcdHasAllFields) {
  const testing::TemporaryFolder folder;
  Scan scan;
  scan.points.push_back({{1, 2, 3}, 3.74f, 77.0f, Duration(50'000'000), 9, 0, kFirstObstacle});
  write_scan_pcd(folder / "s.pcd", scan);
  testing::expect_contains(testing::read_file(folder / "s.pcd"),
                           "FIELDS x y z intensity range time ring label\nSIZE 4 4 4 4 4 4 2 2\n");
  std::vector<CloudPoint> batch;
  ASSERT_TRUE(open_cloud(folder / "s.pcd")->read(batch));
  EXPECT_EQ(batch.at(0).position, Vector3d(1, 2, 3));
  EXPECT_EQ(batch.at(0).intensity, 77.0f);
}

}  // namespace
}  // namespace pointflight
