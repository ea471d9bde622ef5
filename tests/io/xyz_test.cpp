// Text clouds: XYZ, PTS, CSV.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <liblzf/lzf.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "pointflight/io/cloud_reader.hpp"
#include "pointflight/io/pcd_writer.hpp"
#include "tests/io/clouds.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;
using testing::expect_points;
using testing::read_all;
using testing::TemporaryFolder;
using testing::write_file;

TEST(Xyz, TextInItsCommonShapes) {
  const TemporaryFolder folder;
  write_file(folder / "plain.xyz", "# comment\n1.5 -2.25 3\n\n0 .5 -0.125\r\n-7 8 9.5");
  expect_points(read_all(folder / "plain.xyz"), false);
  write_file(folder / "four.txt", "1.5;-2.25;3;10\n0;0.5;-0.125;20\n-7;8;9.5;30\n");
  expect_points(read_all(folder / "four.txt"), true);
  write_file(folder / "names.csv",
             "id,Intensity,Z,Y,X\n1,10,3,-2.25,1.5\n2,20,-0.125,0.5,0\n3,30,9.5,8,-7\n");
  expect_points(read_all(folder / "names.csv"), true);
  write_file(folder / "cloud.pts",
             "3\n1.5 -2.25 3 10 1 2 3\n0 0.5 -0.125 20 1 2 3\n-7 8 9.5 30 1 2 3\n");
  expect_points(read_all(folder / "cloud.pts"), true);
}

TEST(Xyz, EmptyCellsKeepTheColumnsInPlace) {
  const TemporaryFolder folder;
  // pandas' to_csv with an index; a label that is sometimes missing; quoted numbers; a mark first
  write_file(folder / "a.csv",
             "\xef\xbb\xbf,x,label,y,z,intensity\r\n"
             "0,1.5,wall,2.5,3.5,7\r\n1,\"4\",,5,6,8\r\n2,,wall,1,1,9\r\n");
  const auto points = read_all(folder / "a.csv");
  ASSERT_EQ(points.size(), 3u);
  EXPECT_EQ(points[0].position, Vector3d(1.5, 2.5, 3.5));
  EXPECT_EQ(points[1].position, Vector3d(4, 5, 6));
  EXPECT_EQ(points[1].intensity, 8.0f);
  EXPECT_TRUE(std::isnan(points[2].position.x()));
}

TEST(Xyz, ACommentMayNameTheColumns) {
  const TemporaryFolder folder;
  write_file(folder / "a.txt", "//X Y Z R G B Intensity\n1 2 3 10 11 12 99 # first\n");
  EXPECT_EQ(read_all(folder / "a.txt").at(0).intensity, 99.0f);
}

TEST(Xyz, SeveralScansInAPtsFileEachWithItsCount) {
  const TemporaryFolder folder;
  write_file(folder / "a.pts", "2\n1 2 3 50\n4 5 6 51\n1\n7 8 9 52\n");
  EXPECT_EQ(read_all(folder / "a.pts").size(), 3u);
}

TEST(Xyz, TooLargeNumbersAreInfiniteAndDecimalCommasAnError) {
  const TemporaryFolder folder;
  write_file(folder / "a.xyz", "1e400 2 3\n1e-400 2 3\n");
  const auto points = read_all(folder / "a.xyz");
  EXPECT_TRUE(std::isinf(points.at(0).position.x()));
  EXPECT_EQ(points.at(1).position.x(), 0.0);
  write_file(folder / "b.xyz", "1,5 2,5 3,5\n");
  expect_contains(error_of([&] { read_all(folder / "b.xyz"); }), "b.xyz:1:");
}

TEST(Xyz, NotANumberIsPassedOnAndAWordIsAnError) {
  const TemporaryFolder folder;
  write_file(folder / "a.xyz", "1 2 nan\n1 inf 3\n");
  const auto points = read_all(folder / "a.xyz");
  EXPECT_TRUE(std::isnan(points.at(0).position.z()));
  EXPECT_TRUE(std::isinf(points.at(1).position.y()));
  write_file(folder / "b.xyz", "1 2 3\n1 zwei 3\n");
  expect_contains(error_of([&] { read_all(folder / "b.xyz"); }), "b.xyz:2: 'zwei' is no number");
  write_file(folder / "c.xyz", "1 2 3\n1 2\n");
  expect_contains(error_of([&] { read_all(folder / "c.xyz"); }), "c.xyz:2: 2 columns");
  write_file(folder / "d.csv", "a,b\n1,2\n");
  expect_contains(error_of([&] { read_all(folder / "d.csv"); }), "d.csv:1:");
}

}  // namespace
}  // namespace pointflight
