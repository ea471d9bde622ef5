#include "pointflight/survey/resolution_search.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace pointflight {
namespace {

/// Tries whose rays `right` judges; those of the points' own spacing are at `spacing`.
template <class Right>
std::vector<TriedResolution> searched(double spacing, const Right& right, double slack = 0.0) {
  const auto try_one = [&](const std::optional<double>& resolution) {
    const double r = resolution.value_or(spacing);
    return TriedResolution{r, right(r), 1000};
  };
  return search_resolutions(try_one, slack);
}

/// A hill in the logarithm of the resolution.
auto hill(double top) {
  return [top](double r) { return 0.9 - 0.1 * std::abs(std::log2(r / top)); };
}

TEST(ResolutionSearch, ClimbsUntilItFalls) {
  // far above what the points support, as where a survey's scans lie on each other
  const auto tried = searched(0.02, hill(0.32));
  EXPECT_NEAR(best_resolution(tried, 0.003), 0.32, 0.001);
  EXPECT_EQ(tried.size(), 10u);  // eight steps to the top, and the one that falls
  EXPECT_DOUBLE_EQ(tried.front().resolution, 0.02);
}

TEST(ResolutionSearch, GoesFinerIfCoarserIsWorse) {
  const auto tried = searched(0.16, hill(0.04));
  EXPECT_NEAR(best_resolution(tried, 0.003), 0.04, 0.001);
  EXPECT_EQ(tried.size(), 7u);  // one coarser, four to the top and the one that falls
  for (std::size_t i = 1; i < tried.size(); ++i) {
    EXPECT_LT(tried[i - 1].resolution, tried[i].resolution);
  }
}

TEST(ResolutionSearch, TakesTheFinestOfWhatIsLevel) {
  const auto tried = searched(0.05, [](double r) { return r < 0.06 ? 0.8 : 0.9 + 0.001 * r; });
  EXPECT_NEAR(best_resolution(tried, 0.003), 0.05 * std::sqrt(2.0), 1e-9);
}

TEST(ResolutionSearch, RefinesAroundTheBest) {
  const auto try_one = [](const std::optional<double>& resolution) {
    const double r = resolution.value_or(0.05);
    return TriedResolution{r, hill(0.06)(r), 1000};
  };
  const auto tried = refine_resolutions(search_resolutions(try_one, 0.0), try_one);
  // three up to the one that falls, and two beside the best
  ASSERT_EQ(tried.size(), 5u);
  EXPECT_NEAR(best_resolution(tried, 0.0), 0.05 * std::sqrt(std::sqrt(2.0)), 1e-9);
}

TEST(ResolutionSearch, GoesOnOverADipIfAllowed) {
  const auto dip = [](double r) { return hill(0.2)(r) - (r > 0.09 && r < 0.11 ? 0.052 : 0.0); };
  EXPECT_NEAR(best_resolution(searched(0.05, dip), 0.0), 0.05 * std::sqrt(2.0), 1e-9);
  EXPECT_NEAR(best_resolution(searched(0.05, dip, 0.01), 0.0), 0.2, 1e-9);
}

TEST(ResolutionSearch, FindsThePeakBetweenWhatWasTried) {
  const auto parabola = [](double r) { return 0.9 - 0.02 * std::pow(std::log2(r / 0.09), 2.0); };
  const auto tried = searched(0.05, parabola, 0.01);
  EXPECT_NEAR(peak_resolution(tried), 0.09, 1e-9);
  // half a percent to and fro moves it by a tenth of an octave at most
  std::vector<TriedResolution> rough = tried;
  for (std::size_t i = 0; i < rough.size(); ++i) rough[i].right += i % 2 == 0 ? 0.0025 : -0.0025;
  EXPECT_NEAR(std::log2(peak_resolution(rough) / 0.09), 0.0, 0.1);
  // too few
  EXPECT_EQ(peak_resolution({{0.1, 0.8, 100}, {0.2, 0.9, 100}, {0.4, 0.7, 100}}), 0.2);
}

TEST(ResolutionSearch, EndsWhereMapsAreOfNoUse) {
  const auto tried = searched(0.05, [](double r) { return r; });
  EXPECT_LT(tried.back().resolution, 1.0);
  const auto fine = searched(0.05, [](double r) { return -r; });
  EXPECT_GT(fine.front().resolution, 0.005);
}

TEST(ResolutionSearch, TriesOneIfNothingJudges) {
  const auto tried = search_resolutions(
      [](const std::optional<double>& resolution) {
        return TriedResolution{resolution.value_or(0.1), 0.0, 0};
      },
      0.0);
  EXPECT_EQ(tried.size(), 1u);
  EXPECT_EQ(best_resolution(tried, 0.003), 0.1);
}

}  // namespace
}  // namespace pointflight
