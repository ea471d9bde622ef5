#include "pointflight/survey/resolution_search.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace pointflight {
namespace {

/// Tries whose rays `right` judges; those of the points' own spacing are at `spacing`.
template <class Right>
std::vector<TriedResolution> searched(double spacing, const Right& right) {
  return search_resolutions([&](const std::optional<double>& resolution) {
    const double r = resolution.value_or(spacing);
    return TriedResolution{r, right(r), 1000};
  });
}

/// A hill in the logarithm of the resolution.
auto hill(double top) {
  return [top](double r) { return 0.9 - 0.1 * std::abs(std::log2(r / top)); };
}

TEST(ResolutionSearch, ClimbsUntilItFalls) {
  // far above what the points support, as where a survey's scans lie on each other
  const auto tried = searched(0.02, hill(0.32));
  EXPECT_NEAR(best_resolution(tried), 0.32, 0.001);
  EXPECT_EQ(tried.size(), 10u);  // eight steps to the top, and the one that falls
  EXPECT_DOUBLE_EQ(tried.front().resolution, 0.02);
}

TEST(ResolutionSearch, GoesFinerIfCoarserIsWorse) {
  const auto tried = searched(0.16, hill(0.04));
  EXPECT_NEAR(best_resolution(tried), 0.04, 0.001);
  EXPECT_EQ(tried.size(), 7u);  // one coarser, four to the top and the one that falls
  for (std::size_t i = 1; i < tried.size(); ++i) {
    EXPECT_LT(tried[i - 1].resolution, tried[i].resolution);
  }
}

TEST(ResolutionSearch, TakesTheFinestOfWhatIsLevel) {
  const auto tried = searched(0.05, [](double r) { return r < 0.06 ? 0.8 : 0.9 + 0.001 * r; });
  EXPECT_NEAR(best_resolution(tried), 0.05 * std::sqrt(2.0), 1e-9);
}

TEST(ResolutionSearch, EndsWhereMapsAreOfNoUse) {
  const auto tried = searched(0.05, [](double r) { return r; });
  EXPECT_LT(tried.back().resolution, 1.0);
  const auto fine = searched(0.05, [](double r) { return -r; });
  EXPECT_GT(fine.front().resolution, 0.005);
}

TEST(ResolutionSearch, TriesOneIfNothingJudges) {
  const auto tried = search_resolutions([](const std::optional<double>& resolution) {
    return TriedResolution{resolution.value_or(0.1), 0.0, 0};
  });
  EXPECT_EQ(tried.size(), 1u);
  EXPECT_EQ(best_resolution(tried), 0.1);
}

}  // namespace
}  // namespace pointflight
