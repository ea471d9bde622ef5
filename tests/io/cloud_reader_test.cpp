#include "pointflight/io/cloud_reader.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <liblzf/lzf.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "pointflight/io/pcd_writer.hpp"
#include "tests/io/clouds.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;
using testing::expect_points;
using testing::kPoints;
using testing::read_all;
using testing::TemporaryFolder;
using testing::write_file;

template <class T>
void put(std::string& bytes, T value, bool big_endian = false) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  for (std::size_t i = 0; i < sizeof(T); ++i) bytes += raw[big_endian ? sizeof(T) - 1 - i : i];
}

/// Three points that every format test writes: exact in float.
std::string pcd_header(
    const char* fields, const char* sizes, const char* types, const char* data, int points = 3) {
  return fmt::format(
      "# .PCD v0.7\nVERSION 0.7\nFIELDS {}\nSIZE {}\nTYPE {}\nWIDTH {}\nHEIGHT 1\n"
      "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {}\nDATA {}\n",
      fields,
      sizes,
      types,
      points,
      points,
      data);
}

TEST(Pcd, AsciiWithFieldsInAnyOrder) {
  const TemporaryFolder folder;
  std::string text = pcd_header("intensity z y x label", "4 4 4 4 4", "F F F F U", "ascii");
  for (const CloudPoint& p : kPoints) {
    text +=
        fmt::format("{} {} {} {} 7\n", p.intensity, p.position.z(), p.position.y(), p.position.x());
  }
  write_file(folder / "a.pcd", text);
  expect_points(read_all(folder / "a.pcd"), true);
}

TEST(Pcd, BinaryWithDoublesIntegersAndPadding) {
  const TemporaryFolder folder;
  std::string bytes = pcd_header("_ x y intensity z", "1 8 8 2 4", "U F F U F", "binary");
  for (const CloudPoint& p : kPoints) {
    put(bytes, std::uint8_t{0});
    put(bytes, p.position.x());
    put(bytes, p.position.y());
    put(bytes, static_cast<std::uint16_t>(p.intensity));
    put(bytes, static_cast<float>(p.position.z()));
  }
  write_file(folder / "a.pcd", bytes);
  expect_points(read_all(folder / "a.pcd"), true);
}

std::string compressed_pcd() {
  // columns one after another, then LZF
  std::string columns;
  for (const CloudPoint& p : kPoints) put(columns, static_cast<float>(p.position.x()));
  for (const CloudPoint& p : kPoints) put(columns, static_cast<float>(p.position.y()));
  for (const CloudPoint& p : kPoints) put(columns, p.position.z());
  for (const CloudPoint& p : kPoints) put(columns, p.intensity);
  std::string packed(columns.size() * 2 + 16, '\0');
  const unsigned size = lzf_compress(columns.data(),
                                     static_cast<unsigned>(columns.size()),
                                     packed.data(),
                                     static_cast<unsigned>(packed.size()));
  std::string bytes = pcd_header("x y z intensity", "4 4 8 4", "F F F F", "binary_compressed");
  put(bytes, size);
  put(bytes, static_cast<std::uint32_t>(columns.size()));
  return bytes + packed.substr(0, size);
}

TEST(Pcd, BinaryCompressed) {
  const TemporaryFolder folder;
  write_file(folder / "a.pcd", compressed_pcd());
  expect_points(read_all(folder / "a.pcd"), true);
}

TEST(Pcd, WhatWeWriteReadsBack) {
  const TemporaryFolder folder;
  write_cloud_pcd(OutputFile(folder / "near.pcd"), kPoints, true);
  expect_points(read_all(folder / "near.pcd"), true);
  // UTM coordinates keep their millimetres
  std::vector<CloudPoint> far = {{{500000.123, 5400000.456, 300.789}, 0.0f}};
  write_cloud_pcd(OutputFile(folder / "far.pcd"), far, false);
  EXPECT_EQ(read_all(folder / "far.pcd").at(0).position, far[0].position);
}

TEST(Pcd, BadFilesSayWhereAndWhat) {
  const TemporaryFolder folder;
  struct Case {
    std::string bytes;
    const char* words;
  };
  std::string cut = pcd_header("x y z", "4 4 4", "F F F", "binary");
  cut += std::string(20, '\0');
  std::string bad_lzf = compressed_pcd();
  bad_lzf.resize(bad_lzf.size() - 5);
  std::string impossible = pcd_header("x y z", "4 4 4", "F F F", "binary_compressed");
  put(impossible, std::uint32_t{4});
  put(impossible, std::uint32_t{0xf0000000u});
  impossible += "abcd";
  const Case cases[] = {
      {"", "empty"},
      {"hello\n", "not a PCD header key"},
      {"VERSION 0.7\nFIELDS x y z\n", "no DATA line"},
      {pcd_header("x y", "4 4", "F F", "ascii", 0), "no field 'z'"},
      {pcd_header("x y z", "4 4 4", "F F Q", "ascii"), "TYPE 'Q' is unknown"},
      {pcd_header("x y z", "4 4 3", "F F F", "ascii"), "a float of 3 bytes"},
      {pcd_header("x y z", "4 4 -4", "F F F", "ascii"), "SIZE wants a whole number"},
      {pcd_header("x y z", "4 4 4", "F F F", "zipped"), "DATA 'zipped' is unknown"},
      {pcd_header("x y z", "4 4 4", "F F F", "ascii") + "1 2 3\n1 two 3\n",
       ":12: 'two' is no number"},
      {pcd_header("x y z", "4 4 4", "F F F", "ascii") + "1 2 3\n1 2\n", ":12: 2 numbers"},
      {pcd_header("x y z", "4 4 4", "F F F", "ascii") + "1 2 3\n",
       "promises 3 points, the file has 1"},
      {cut, "promises 3 points of 12 bytes, the file has 1"},
      {pcd_header("x y z", "4 4 4", "F F F", "binary", 1000000000), "promises 1000000000 points"},
      {bad_lzf, "cut off"},
      {impossible, "impossible"},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.words);
    write_file(folder / "a.pcd", c.bytes);
    const std::string error = error_of([&] { read_all(folder / "a.pcd"); });
    expect_contains(error, "a.pcd");
    expect_contains(error, c.words);
  }
}

std::string ply_header(const char* format) {
  return fmt::format(
      "ply\nformat {} 1.0\ncomment made by a test\nelement station 1\nproperty list uchar int ids\n"
      "property float height\nelement vertex 3\nproperty uchar red\nproperty float x\n"
      "property float y\nproperty double z\nproperty float scalar_Intensity\nend_header\n",
      format);
}

TEST(Ply, AsciiAfterAnotherElement) {
  const TemporaryFolder folder;
  std::string text = ply_header("ascii") + "2 5 6 1.5\n";
  for (const CloudPoint& p : kPoints) {
    text += fmt::format(
        "255 {} {} {} {}\n", p.position.x(), p.position.y(), p.position.z(), p.intensity);
  }
  write_file(folder / "a.ply", text);
  expect_points(read_all(folder / "a.ply"), true);
}

TEST(Ply, BinaryOfBothEndians) {
  const TemporaryFolder folder;
  for (const bool big : {false, true}) {
    std::string bytes = ply_header(big ? "binary_big_endian" : "binary_little_endian");
    put(bytes, std::uint8_t{2}, big);
    put(bytes, std::int32_t{5}, big);
    put(bytes, std::int32_t{6}, big);
    put(bytes, 1.5f, big);
    for (const CloudPoint& p : kPoints) {
      put(bytes, std::uint8_t{255}, big);
      put(bytes, static_cast<float>(p.position.x()), big);
      put(bytes, static_cast<float>(p.position.y()), big);
      put(bytes, p.position.z(), big);
      put(bytes, p.intensity, big);
    }
    write_file(folder / "a.ply", bytes);
    expect_points(read_all(folder / "a.ply"), true);
    bytes.resize(bytes.size() - 1);
    write_file(folder / "a.ply", bytes);
    expect_contains(error_of([&] { read_all(folder / "a.ply"); }), "cut off");
  }
}

TEST(Ply, BadFilesSayWhereAndWhat) {
  const TemporaryFolder folder;
  struct Case {
    std::string bytes;
    const char* words;
  };
  const Case cases[] = {
      {"plx\n", "not 'ply'"},
      {"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n",
       "lacks x, y or z"},
      {"ply\nformat octal 1.0\nend_header\n", "format 'octal' is unknown"},
      {"ply\nformat ascii 1.0\nend_header\n", "no 'vertex' element"},
      {"ply\nformat ascii 1.0\nelement vertex 1\n", "no end_header"},
      {"ply\nformat ascii 1.0\nelement vertex 2\nproperty quad x\n", "type 'quad' is unknown"},
      {"ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty "
       "float "
       "z\nend_header\n1 2 3\n4 5\n",
       ":9: too few numbers"},
      {"ply\nformat binary_little_endian 1.0\nelement vertex 1000000000\nproperty float "
       "x\nproperty "
       "float y\nproperty float z\nend_header\nabc",
       "promises 1000000000 'vertex' rows"},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.words);
    write_file(folder / "a.ply", c.bytes);
    expect_contains(error_of([&] { read_all(folder / "a.ply"); }), c.words);
  }
}

TEST(Pcd, SizesBeforeFieldsAndProductsThatOverflow) {
  const TemporaryFolder folder;
  std::string bytes =
      "VERSION 0.7\nSIZE 8 8 8\nTYPE F F F\n  # odd, but legal\nFIELDS x y z\nWIDTH "
      "1\nHEIGHT 1\nDATA binary\n";
  for (const double v : {1.0, 2.0, 3.0}) bytes.append(reinterpret_cast<const char*>(&v), 8);
  write_file(folder / "a.pcd", bytes);
  EXPECT_EQ(read_all(folder / "a.pcd").at(0).position, Vector3d(1, 2, 3));
  write_file(folder / "b.pcd",
             "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1000000000000\nHEIGHT 1000000000000\n"
             "DATA binary\n");
  expect_contains(error_of([&] { read_all(folder / "b.pcd"); }), "is no number of points");
  write_file(folder / "c.pcd", "FIELDS x y z\nSIZE 4 4\nTYPE F F F\nPOINTS 1\nDATA binary\n");
  expect_contains(error_of([&] { read_all(folder / "c.pcd"); }), "SIZE has 2 values for 3 FIELDS");
}

TEST(Ply, RowsWithoutPropertiesAreAnError) {
  const TemporaryFolder folder;
  write_file(
      folder / "a.ply",
      "ply\nformat ascii 1.0\nelement foo 1000000000000\nelement vertex 1\nproperty float x\n"
      "property float y\nproperty float z\nend_header\n1 2 3\n");
  expect_contains(error_of([&] { read_all(folder / "a.ply"); }),
                  "'foo' has rows but no properties");
}

std::string las(unsigned minor, unsigned format) {
  const std::size_t header = minor >= 4 ? 375 : 227;
  const std::size_t point = format == 6 ? 30 : 20;
  std::string bytes(header, '\0');
  const auto set = [&](std::size_t at, auto value) {
    std::memcpy(&bytes[at], &value, sizeof value);
  };
  std::memcpy(bytes.data(), "LASF", 4);
  bytes[24] = 1;
  bytes[25] = static_cast<char>(minor);
  set(94, static_cast<std::uint16_t>(header));
  set(96, static_cast<std::uint32_t>(header));
  bytes[104] = static_cast<char>(format);
  set(105, static_cast<std::uint16_t>(point));
  if (minor >= 4) {
    set(247, std::uint64_t{3});
  } else {
    set(107, std::uint32_t{3});
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    set(131 + 8 * axis, 0.125);
    set(155 + 8 * axis, 1.0);
  }
  for (const CloudPoint& p : kPoints) {
    std::string row;
    for (int axis = 0; axis < 3; ++axis) {
      put(row, static_cast<std::int32_t>((p.position[axis] - 1.0) / 0.125));
    }
    put(row, static_cast<std::uint16_t>(p.intensity));
    row.resize(point);
    bytes += row;
  }
  return bytes;
}

TEST(Las, VersionsAndFormats) {
  const TemporaryFolder folder;
  for (const auto& [minor, format] : {std::pair(2u, 0u), std::pair(3u, 0u), std::pair(4u, 6u)}) {
    write_file(folder / "a.las", las(minor, format));
    expect_points(read_all(folder / "a.las"), true);
  }
}

TEST(Las, WithheldPointsAndNoiseAreLeftOutAndCounted) {
  const TemporaryFolder folder;
  for (const unsigned format : {0u, 6u}) {
    SCOPED_TRACE(format);
    std::string bytes = las(format == 0 ? 2u : 4u, format);
    const std::size_t points = bytes.size() - 3 * (format == 0 ? 20u : 30u);
    const std::size_t row = (bytes.size() - points) / 3;
    bytes[points + 15] = static_cast<char>(format == 0 ? 128 : 4);  // withheld
    bytes[points + row + (format == 0 ? 15 : 16)] = 7;              // low points
    write_file(folder / "a.las", bytes);
    const auto reader = open_cloud(folder / "a.las");
    std::vector<CloudPoint> batch;
    ASSERT_TRUE(reader->read(batch));
    ASSERT_EQ(batch.size(), 1u);
    EXPECT_EQ(batch[0].position, kPoints[2].position);
    const auto notes = reader->columns().notes;
    ASSERT_EQ(notes.size(), 2u);
    expect_contains(notes[0], "1 points that it withholds");
    expect_contains(notes[1], "1 points that it classes as noise");
  }
}

TEST(Las, BadFilesSayWhereAndWhat) {
  const TemporaryFolder folder;
  std::string laz = las(2, 0);
  laz[104] = static_cast<char>(0x80);
  std::string cut = las(2, 0);
  cut.resize(cut.size() - 1);
  std::string version = las(2, 0);
  version[24] = 2;
  std::string scale = las(2, 0);
  std::memset(&scale[131], 0, 8);
  std::string outside = las(2, 0);
  outside[99] = 0x7f;
  struct Case {
    std::string bytes;
    const char* words;
  };
  const Case cases[] = {{"LAS", "does not start with a LAS header"},
                        {laz, "laszip -i"},
                        {cut, "promises 3 points of 20 bytes, the file has 2"},
                        {version, "LAS version 2.2"},
                        {scale, "byte 131"},
                        {outside, "outside the file"}};
  for (const Case& c : cases) {
    SCOPED_TRACE(c.words);
    write_file(folder / "a.las", c.bytes);
    expect_contains(error_of([&] { read_all(folder / "a.las"); }), c.words);
  }
  write_file(folder / "a.laz", "x");
  expect_contains(error_of([&] { open_cloud(folder / "a.laz"); }), "laszip -i");
}

TEST(Mesh, IsSampledEvenlyByArea) {
  const TemporaryFolder folder;
  // a 1 x 1 square and a 3 x 3 square
  write_file(folder / "a.obj",
             "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 10 0 5\nv 13 0 5\nv 13 3 5\nv 10 3 5\n"
             "f 1 2 3 4\nf 5 6 7 8\n");
  MeshSampling sampling;
  sampling.points_per_square_metre = 500.0;
  const std::vector<CloudPoint> points = read_all(folder / "a.obj", sampling);
  std::size_t small = 0;
  std::size_t left_half = 0;
  for (const CloudPoint& p : points) {
    small += p.position.z() < 1.0 ? 1 : 0;
    left_half += p.position.z() > 1.0 && p.position.x() < 11.5 ? 1 : 0;
    EXPECT_TRUE(p.position.z() == 0.0 || p.position.z() == 5.0);
  }
  EXPECT_NEAR(static_cast<double>(small), 500.0, 2.0);
  EXPECT_NEAR(static_cast<double>(points.size()), 5000.0, 2.0);
  // five standard deviations of a binomial
  EXPECT_NEAR(static_cast<double>(left_half), 2250.0, 5.0 * std::sqrt(4500.0 * 0.25));
  EXPECT_TRUE(is_mesh(folder / "a.obj"));
  write_file(folder / "b.obj", "not a mesh at all");
  expect_contains(error_of([&] { open_cloud(folder / "b.obj"); }), "b.obj");
}

TEST(Mesh, APlyWithFacesIsAMesh) {
  const TemporaryFolder folder;
  write_file(
      folder / "a.ply",
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  EXPECT_TRUE(is_mesh(folder / "a.ply"));
}

TEST(CloudReader, UnknownExtensionsNameTheKnownOnes) {
  const TemporaryFolder folder;
  write_file(folder / "a.laz", "x");
  expect_contains(error_of([&] { open_cloud(folder / "a.laz"); }), "pdal translate");
  write_file(folder / "a.shp", "x");
  expect_contains(error_of([&] { open_cloud(folder / "a.shp"); }), ".pcd .ply .xyz");
  expect_contains(error_of([&] { open_cloud(folder / "absent.pcd"); }), "No such file");
  expect_contains(error_of([&] { open_cloud(folder.path()); }), "not a regular file");
}

}  // namespace
}  // namespace pointflight
