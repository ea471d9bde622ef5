// Polynomials and B-splines that a vehicle follows.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "pointflight/core/constants.hpp"
#include "pointflight/geometry/rotation.hpp"
#include "pointflight/vehicle/autopilot.hpp"
#include "pointflight/vehicle/multirotor.hpp"
#include "pointflight/vehicle/step_response.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;

TEST(Trajectory, PolynomialsDerivativesAreThoseOfItsPositions) {
  PolynomialTrajectory::Piece a;
  a.duration = 1.5;
  a.coefficients = {std::vector<double>{0, 1, -0.5, 0.25, 0.1},
                    {1, 0, 0.3},
                    {2, 0.1, 0, 0, 0, -0.01},
                    {0.1, 0.2}};
  PolynomialTrajectory::Piece b = a;
  b.duration = 2.0;
  const PolynomialTrajectory trajectory({a, b});
  EXPECT_DOUBLE_EQ(trajectory.duration(), 3.5);
  for (double t = 0.01; t < 3.5; t += 0.0173) {
    if (std::abs(t - 1.5) < 1e-3) continue;
    const double h = 1e-5;
    const auto at = trajectory.at(t);
    const auto before = trajectory.at(t - h);
    const auto after = trajectory.at(t + h);
    EXPECT_LT((at.v_world - (after.p_world - before.p_world) / (2 * h)).norm(), 1e-6);
    EXPECT_LT((at.a_world - (after.v_world - before.v_world) / (2 * h)).norm(), 1e-6);
    EXPECT_LT((at.jerk_world - (after.a_world - before.a_world) / (2 * h)).norm(), 1e-5);
    EXPECT_NEAR(at.yaw_rate, (after.yaw - before.yaw) / (2 * h), 1e-8);
  }
  EXPECT_EQ(trajectory.at(9).p_world, trajectory.at(3.5).p_world);
  EXPECT_EQ(trajectory.at(9).v_world, Vector3d::Zero());
  const auto read = PolynomialTrajectory::parse(
      "duration,x^0,x^1,y^0,y^1,z^0,z^1,yaw^0\n2,0,1,0,2,1,0,0\n1,2,0,4,0,1,0,0\n", "p.csv");
  EXPECT_TRUE(read->at(1.0).p_world.isApprox(Vector3d(1, 2, 1)));
  expect_contains(
      error_of([] { PolynomialTrajectory::parse("duration,x^0,y^0,z^0\n-1,0,0,0\n", "p.csv"); }),
      "p.csv:2: ");
  expect_contains(error_of([] { PolynomialTrajectory::parse("duration,x^0\n1,0\n", "p.csv"); }),
                  "'y^");
  expect_contains(error_of([] {
                    PolynomialTrajectory::parse("duration,x^0,y^0,z^0\n1,0,0,0\n1,1e300,0,0\n",
                                                "p.csv");
                  }),
                  "p.csv:3: ");
}

TEST(Trajectory, BSplinesInterpolateLinesAndDifferentiate) {
  // control points on a line at equal intervals: constant speed
  std::vector<Eigen::Vector4d> line;
  for (int i = 0; i < 8; ++i) line.emplace_back(2.0 * i, -i, 1.0, 0.1 * i);
  const auto spline = BSplineTrajectory::uniform(line, 3, 0.5);
  EXPECT_DOUBLE_EQ(spline->duration(), 2.5);
  for (double t = 0; t <= 2.5; t += 0.1) {
    const auto c = spline->at(t);
    EXPECT_TRUE(c.v_world.isApprox(Vector3d(4, -2, 0), 1e-12));
    EXPECT_LT(c.a_world.norm(), 1e-9);
    EXPECT_NEAR(
        c.p_world.x(), 2.0 + 4.0 * t, 1e-12);  // its first knot has the mean of three points
    EXPECT_NEAR(c.yaw_rate, 0.2, 1e-12);
  }
  // any points: derivatives against differences
  std::vector<Eigen::Vector4d> points;
  for (int i = 0; i < 9; ++i) {
    points.emplace_back(std::sin(1.3 * i), std::cos(0.7 * i), 0.1 * i * i, 0.2 * i);
  }
  const auto curve = BSplineTrajectory::uniform(points, 4, 0.3);
  for (double t = 0.011; t < curve->duration(); t += 0.037) {
    const double h = 1e-6;
    const auto at = curve->at(t);
    const auto before = curve->at(t - h);
    const auto after = curve->at(t + h);
    EXPECT_LT((at.v_world - (after.p_world - before.p_world) / (2 * h)).norm(), 1e-6);
    EXPECT_LT((at.a_world - (after.v_world - before.v_world) / (2 * h)).norm(), 1e-5);
    EXPECT_LT((at.jerk_world - (after.a_world - before.a_world) / (2 * h)).norm(), 1e-3);
  }
  EXPECT_THROW(BSplineTrajectory::uniform({line[0], line[1]}, 3, 0.5), InputError);
  auto far = line;
  far[3].x() = 1e300;
  expect_contains(error_of([&] { BSplineTrajectory::uniform(far, 3, 0.5); }), "beyond 1e+09");
  const testing::TemporaryFolder folder;
  testing::write_file(folder / "far.csv", "x,y,z\n0,0,1\n1e300,0,1\n2,0,1\n3,0,1\n");
  expect_contains(error_of([&] { BSplineTrajectory::read(folder / "far.csv", 3, 1.0); }),
                  "far.csv:3: a number is missing or beyond 1e+09");
  EXPECT_THROW(BSplineTrajectory(line, 3, std::vector<double>(12, 0.0)), InputError);
}

}  // namespace
}  // namespace pointflight
