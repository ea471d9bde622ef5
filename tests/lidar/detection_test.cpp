#include "pointflight/lidar/detection.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "pointflight/core/math.hpp"
#include "pointflight/lidar/lidar_settings.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;

/// What the sheets say (sources in the sensor files), with the probability that they mean by it.
struct SheetRange {
  std::string sensor;
  double sun_klx, reflectivity, range, probability;
};

const std::vector<SheetRange>& sheets() {
  static const std::vector<SheetRange> rows = {{"avia", 100, 0.1, 190, 0.5},
                                               {"avia", 100, 0.2, 230, 0.5},
                                               {"avia", 100, 0.8, 320, 0.5},
                                               {"avia", 0, 0.1, 190, 0.5},
                                               {"avia", 0, 0.2, 260, 0.5},
                                               {"avia", 0, 0.8, 450, 0.5},
                                               {"mid360", 100, 0.1, 40, 0.5},
                                               {"mid360", 100, 0.8, 70, 0.5},
                                               {"vlp32c", 100, 0.8, 200, 0.5},
                                               {"xt16", 100, 0.1, 80, 0.5},
                                               {"xt32", 100, 0.1, 80, 0.5},
                                               {"xt32m2x", 100, 0.1, 80, 0.5},
                                               {"qt64", 100, 0.1, 20, 0.5},
                                               {"hdl64e", 100, 0.1, 50, 0.5},
                                               {"hdl64e", 100, 0.8, 120, 0.5},
                                               {"os1_32", 100, 0.1, 45, 0.9},
                                               {"os1_32", 100, 0.8, 100, 0.9},
                                               {"os1_128", 100, 0.1, 45, 0.9},
                                               {"os1_128", 100, 0.8, 100, 0.9}};
  return rows;
}

/// Range at which a face-on target comes back with a probability, by halving, m.
double range_at(const DetectionModel& model, double reflectivity, double probability) {
  double near = 0.1;
  double far = 5000.0;
  for (int i = 0; i < 80; ++i) {
    const double middle = 0.5 * (near + far);
    (model.probability(model.margin(reflectivity, middle)) > probability ? near : far) = middle;
  }
  return near;
}

TEST(Detection, MeetsTheRatedRangesOfSheets) {
  for (const SheetRange& row : sheets()) {
    const DetectionModel model(load_lidar(row.sensor).detection, row.sun_klx);
    EXPECT_NEAR(range_at(model, row.reflectivity, row.probability), row.range, 1e-6 * row.range)
        << row.sensor << " on " << 100 * row.reflectivity << " % in " << row.sun_klx << " klx";
  }
}

TEST(Detection, IsThePowerLawThroughTwoRatedRanges) {
  // R = R10 (rho / 0.1)^gamma, an independent form of the same law
  const DetectionModel model(load_lidar("mid360").detection, 100.0);
  const double gamma = std::log(70.0 / 40.0) / std::log(8.0);
  for (const double rho : {0.02, 0.1, 0.35, 0.8, 1.0}) {
    for (const double range : {1.0, 12.0, 40.0, 66.0, 90.0}) {
      const double expected = rho / 0.1 * std::pow(40.0 / range, 1.0 / gamma);
      EXPECT_NEAR(model.margin(rho, range) / expected, 1.0, 1e-9);
    }
    EXPECT_NEAR(model.rated_range(rho), 40.0 * std::pow(rho / 0.1, gamma), 1e-9 * 40.0);
  }
}

TEST(Detection, ALoneRatedRangeFollowsThePureLinkBudget) {
  const DetectionModel model(load_lidar("vlp32c").detection, 100.0);
  EXPECT_NEAR(model.rated_range(0.2), 100.0, 1e-9);
  EXPECT_NEAR(model.margin(0.8, 400.0), 0.25, 1e-12);
}

TEST(Detection, LightBetweenRatedLevelsChangesRangesInProportion) {
  const DetectionSettings avia = load_lidar("avia").detection;
  EXPECT_NEAR(DetectionModel(avia, 50.0).rated_range(0.8), 385.0, 1e-9);
  EXPECT_NEAR(DetectionModel(avia, 150.0).rated_range(0.8), 320.0, 1e-9);
  EXPECT_NEAR(DetectionModel(avia, 25.0).rated_range(0.1), 190.0, 1e-9);
}

TEST(Detection, AWhiteWallIsSeenWhereADarkOneIsNot) {
  const DetectionModel model(load_lidar("mid360").detection, 100.0);
  EXPECT_GT(model.probability(model.margin(0.8, 65.0)), 0.75);
  EXPECT_LT(model.probability(model.margin(0.05, 40.0)), 0.04);
  EXPECT_LT(model.probability(model.margin(1.0, model.reach() + 1e-3)), 1e-3);
}

TEST(Detection, WithoutASignalOnlyFalseAlarmsAreLeft) {
  const DetectionModel model(load_lidar("mid360").detection, 100.0);
  EXPECT_NEAR(model.probability(0.0), 1e-4, 1e-12);
}

TEST(Detection, WithoutRatedRangesAllComesBack) {
  EXPECT_TRUE(DetectionModel(load_lidar("marsim_grid").detection, 100.0).is_ideal());
}

TEST(Detection, ADarkerTargetCannotBeSeenFromFartherAway) {
  const std::string text =
      "range_max: 100\npattern: grid\ndetection:\n  rated:\n"
      "    - {reflectivity: 0.1, range: 50}\n    - {reflectivity: 0.8, range: 40}\n";
  EXPECT_NE(error_of([&] { parse_lidar(text, "my.yaml"); }).find("a brighter target is seen"),
            std::string::npos);
}

TEST(NormalDistribution, AgreesWithTheStandardLibrary) {
  for (double x = -8.0; x <= 8.0; x += 0.37) {
    const double exact = 0.5 * std::erfc(-x / std::sqrt(2.0));
    EXPECT_NEAR(math::normal_probability(x) / exact, 1.0, 1e-13);
    if (exact < 0.999) {
      EXPECT_NEAR(math::normal_quantile(exact), x, 1e-11);
    }
  }
}

}  // namespace
}  // namespace pointflight
