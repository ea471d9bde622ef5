// Reflectivities from a survey's signals, against walls whose reflectivity is known.
#include "pointflight/survey/survey_signal.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "pointflight/core/random.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "pointflight/map/map_file.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;
using testing::map_of;

class SignalRays : public SurveyReader {
 public:
  explicit SignalRays(const std::vector<SurveyRay>& rays) : rays_(rays) {}
  bool read(std::vector<SurveyRay>& batch) override {
    batch.clear();
    for (; next_ < rays_.size() && batch.size() < 5000; ++next_) batch.push_back(rays_[next_]);
    return !batch.empty();
  }
  [[nodiscard]] double share_read() const override { return 0.5; }

 private:
  const std::vector<SurveyRay>& rays_;
  std::size_t next_ = 0;
};

/// Two walls that meet at the line x = y = 8, 16 m wide; a third one that the first hides.
ShapeScene walls() {
  ShapeScene scene;
  scene.add_rectangle({8, -8, -2}, {0, 16, 0}, {0, 0, 4});
  scene.add_rectangle({-8, 8, -2}, {16, 0, 0}, {0, 0, 4});
  scene.add_rectangle({10, -8, -2}, {0, 16, 0}, {0, 0, 4});
  return scene;
}

constexpr double kDark = 0.08;   // the wall at x = 8
constexpr double kBright = 0.4;  // the wall at y = 8
constexpr double kLimit = 25.0;  // of signals

/// Signals by the sensor's own law, from two positions; each return is off by a factor of up to 2.
std::vector<SurveyRay> survey_of(const DetectionModel& sensor, std::size_t count) {
  const RandomStream random(7, StreamId::kTest, 0);
  std::vector<SurveyRay> rays;
  for (std::size_t i = 0; i < count; ++i) {
    const Vector3d from = i % 2 == 0 ? Vector3d(0, 0, 0) : Vector3d(5.5, 5.5, 0);
    const auto [u, v] = random.uniform2(2 * i);
    const bool dark = random.uniform2(2 * i + 1)[0] < 0.5;
    const double along = 15.0 * u - 7.5;
    const Vector3d to =
        dark ? Vector3d(8, along, 3.0 * v - 1.5) : Vector3d(along, 8, 3.0 * v - 1.5);
    SurveyRay ray = survey_ray({Quaterniond::Identity(), from}, to - from, true);
    const double cos =
        std::abs((to - from).normalized().dot(dark ? Vector3d::UnitX() : Vector3d::UnitY()));
    if (cos < 0.3) continue;
    const double margin = sensor.margin((dark ? kDark : kBright) * cos, (to - from).norm());
    const double off = std::exp2(2.0 * random.uniform2(2 * i + 1)[1] - 1.0);
    ray.intensity = static_cast<float>(kLimit * margin / sensor.margin_at(0.15) * off);
    rays.push_back(ray);
  }
  return rays;
}

struct Painted {
  std::shared_ptr<const SurfelMap> map;
  SignalReport report;
};

Painted painted(const SurfelMap& map,
                const std::vector<SurveyRay>& rays,
                const SignalOptions& options,
                int threads = 2) {
  Painted made;
  EditedMap edited = transform_map(map, {}, {}, Executor(1));
  paint_reflectivity(
      edited,
      [&] { return std::make_unique<SignalRays>(rays); },
      options,
      {},
      Executor(threads),
      made.report);
  made.map = SurfelMap::from_bytes(map_bytes(edited.tree, edited.description), "painted");
  made.map->verify();
  return made;
}

/// Median reflectivity of the surfels that `is_there` accepts.
template <class Where>
double median_of(const SurfelMap& map, const Where& is_there) {
  std::vector<double> all;
  map.for_each_surfel([&](const Vector3d& p, const Vector3d&, double, std::uint32_t word) {
    if (is_there(p)) {
      all.push_back(static_cast<double>(map.intensity(word)) * map.reflectivity_per_intensity());
    }
  });
  std::sort(all.begin(), all.end());
  return all[all.size() / 2];
}

TEST(SurveySignal, FindsTheReflectivityOfWallsFromAnyRangeAndIncidence) {
  const auto map = map_of(walls(), 0.2);
  for (const char* name : {"os0_64", "avia"}) {
    SCOPED_TRACE(name);
    SignalOptions options;
    options.detection = load_lidar(name).detection;
    options.detection.near = {{1.0, 0.02}, {4.0, 1.0}};  // one of the positions is that near
    options.limit = kLimit;
    const auto rays = survey_of(DetectionModel(options.detection, options.sun_klx), 60000);
    const Painted made = painted(*map, rays, options);
    EXPECT_EQ(made.report.returns, rays.size());
    EXPECT_EQ(made.report.limit, kLimit);
    const auto in_x = [](double x) {
      return [x](const Vector3d& p) {
        return std::abs(p.x() - x) < 0.1 && std::abs(p.y()) < 6.0 && std::abs(p.z()) < 1.3;
      };
    };
    EXPECT_NEAR(median_of(*made.map, in_x(8.0)), kDark, 0.1 * kDark);
    EXPECT_NEAR(median_of(*made.map,
                          [](const Vector3d& p) {
                            return std::abs(p.y() - 8.0) < 0.1 && std::abs(p.x()) < 6.0 &&
                                   std::abs(p.z()) < 1.3;
                          }),
                kBright,
                0.1 * kBright);
    // never seen: as the darkest
    EXPECT_GT(made.report.unseen, 500u);
    EXPECT_LE(median_of(*made.map, in_x(10.0)), made.report.reflectivities[0] + 0.005);
    EXPECT_LT(made.report.reflectivities[0], made.report.reflectivities[1]);
    EXPECT_LT(made.report.reflectivities[1], made.report.reflectivities[2]);
    expect_contains(std::string(made.map->metadata()), "the weakest 25");
    EXPECT_TRUE(std::equal(map->words().begin(), map->words().end(), made.map->words().begin()));
    EXPECT_EQ(painted(*map, rays, options, 1).map->hash(), made.map->hash());
    EXPECT_EQ(painted(*map, rays, options, 3).map->hash(), made.map->hash());
  }
}

TEST(SurveySignal, TheLimitIsWhatAHundredthOfTheReturnsDoNotReach) {
  const auto map = map_of(walls(), 0.2);
  SignalOptions options;
  options.detection = load_lidar("os0_64").detection;
  std::vector<SurveyRay> rays = survey_of(DetectionModel(options.detection, 100.0), 20000);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    rays[i].intensity = i % 128 == 0 ? 3.0f : 7.0f + static_cast<float>(i % 7 * 100);
  }
  EXPECT_NEAR(painted(*map, rays, options).report.limit, 7.0, 0.2);
  for (SurveyRay& ray : rays) ray.intensity = 0.0f;
  expect_contains(error_of([&] { painted(*map, rays, options); }), "no intensities");
  options.detection.rated.clear();
  expect_contains(error_of([&] { painted(*map, rays, options); }), "no rated ranges");
}

}  // namespace
}  // namespace pointflight
