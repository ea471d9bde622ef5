// Clouds that tests read, and what should be in them.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "pointflight/io/cloud_reader.hpp"

namespace pointflight::testing {

inline std::vector<CloudPoint> read_all(const std::string& path,
                                        const MeshSampling& sampling = {}) {
  const auto reader = open_cloud(path, sampling);
  std::vector<CloudPoint> all;
  std::vector<CloudPoint> batch;
  while (reader->read(batch)) all.insert(all.end(), batch.begin(), batch.end());
  EXPECT_NEAR(reader->share_read(), 1.0, 1e-12);
  return all;
}

/// What is in the files of these tests.
inline const std::vector<CloudPoint> kPoints = {
    {{1.5, -2.25, 3.0}, 10.0f}, {{0.0, 0.5, -0.125}, 20.0f}, {{-7.0, 8.0, 9.5}, 30.0f}};

inline void expect_points(const std::vector<CloudPoint>& got, bool intensity) {
  ASSERT_EQ(got.size(), kPoints.size());
  for (std::size_t i = 0; i < got.size(); ++i) {
    EXPECT_EQ(got[i].position, kPoints[i].position);
    if (intensity) {
      EXPECT_EQ(got[i].intensity, kPoints[i].intensity);
    }
  }
}

}  // namespace pointflight::testing
