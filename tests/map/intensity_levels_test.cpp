// What the codes of intensities stand for.
#include "pointflight/map/intensity_levels.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "pointflight/core/random.hpp"

namespace pointflight {
namespace {

IntensityLevels levels_of(const std::vector<float>& values) {
  IntensityHistogram histogram;
  for (const float value : values) histogram.add(value);
  return histogram.levels();
}

TEST(IntensityLevels, AreLinearUnlessAFewTakeTheStepsFromAllOthers) {
  const IntensityLevels plain = levels_of({10.0f, 20.0f, 265.0f});
  EXPECT_TRUE(plain.is_linear);
  EXPECT_EQ(plain.of_code[0], 10.0f);
  EXPECT_EQ(plain.step, 1.0f);
  EXPECT_EQ(plain.code_of(20.4f), 10);
  EXPECT_EQ(plain.code_of(-1e9f), 0);
  EXPECT_EQ(plain.code_of(1e9f), 255);
  EXPECT_EQ(levels_of({}).code_of(3.0f), 0);
  EXPECT_EQ(levels_of({7.0f, 7.0f}).code_of(7.0f), 0) << "one value is one level";
  EXPECT_EQ(levels_of({7.0f, 7.0f}).of_code[0], 7.0f);
}

TEST(IntensityLevels, OutliersHaveCoarseOnes) {
  std::vector<float> values(100000);
  const RandomStream random(1, StreamId::kTest, 0);
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = static_cast<float>(10.0 + 180.0 * random.uniform(i));
  }
  for (std::size_t i = 0; i < 50; ++i) values[i] = 300.0f * (1.0f + 4.0f * static_cast<float>(i));
  const IntensityLevels levels = levels_of(values);
  EXPECT_FALSE(levels.is_linear);
  EXPECT_TRUE(std::is_sorted(levels.of_code.begin(), levels.of_code.end()));
  EXPECT_NEAR(levels.usual_end(), 190.0, 2.0);
  for (const float value : values) {
    const float kept = levels.of_code[levels.code_of(value)];
    if (value <= levels.usual_end()) {
      EXPECT_LE(std::abs(kept - value), 0.5f) << value;
    } else {
      EXPECT_LE(std::abs(kept / value - 1.0f), 0.22f) << value;
    }
  }
}

TEST(IntensityLevels, NegativeValuesAreInOrder) {
  std::vector<float> values;
  for (int i = 0; i < 2000; ++i) values.push_back(-100.0f + 0.05f * static_cast<float>(i));
  values.push_back(1e6f);
  const IntensityLevels levels = levels_of(values);
  EXPECT_FALSE(levels.is_linear);
  EXPECT_EQ(levels.of_code[0], -100.0f);
  EXPECT_EQ(levels.of_code[255], 1e6f);
  EXPECT_NEAR(levels.usual_end(), 0.0, 1.0);
}

}  // namespace
}  // namespace pointflight
