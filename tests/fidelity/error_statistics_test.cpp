#include "pointflight/fidelity/error_statistics.hpp"

#include <gtest/gtest.h>

namespace pointflight {
namespace {

TEST(ErrorStatistics, SharesOfAllRaysAndPercentilesOfTheRightOnes) {
  ErrorCollector collector;
  for (int i = 0; i < 100; ++i) collector.add(5.0, 5.0 + 0.001 * (i % 10));  // 0 to 9 mm late
  for (int i = 0; i < 20; ++i) collector.add(5.0, 4.0);
  for (int i = 0; i < 10; ++i) collector.add(5.0, 7.0);
  ErrorCollector missing;
  for (int i = 0; i < 70; ++i) missing.add(5.0, std::nullopt);
  collector.add(missing);
  const ErrorStatistics s = collector.statistics();
  EXPECT_EQ(s.rays, 200u);
  EXPECT_DOUBLE_EQ(s.early_fraction, 0.10);
  EXPECT_DOUBLE_EQ(s.late_fraction, 0.05);
  EXPECT_DOUBLE_EQ(s.wrong_fraction, 0.15);
  EXPECT_DOUBLE_EQ(s.missing_fraction, 0.35);
  EXPECT_NEAR(s.bias, 0.0045, 1e-6);
  EXPECT_NEAR(s.median_abs_error, 0.004, 1e-6);
  EXPECT_NEAR(s.p90_abs_error, 0.008, 1e-6);
}

TEST(ErrorStatistics, NoRaysAreNoError) {
  EXPECT_EQ(ErrorCollector().statistics().rays, 0u);
}

}  // namespace
}  // namespace pointflight
