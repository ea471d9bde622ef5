#include "pointflight/io/cloud_writer.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstring>
#include <thread>

#include "pointflight/io/file_unit.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;
using testing::read_file;
using testing::TemporaryFolder;
using testing::write_file;

const std::vector<CloudPoint> kWritten = {{{1.5, -2.25, 3.0}, 10.0f, {255, 0, 7}},
                                          {{0.0, 0.5, -0.125}, 20.0f, {1, 2, 3}},
                                          {{-7.0, 8.0, 9.5}, 30.0f, {0, 128, 255}}};

std::vector<CloudPoint> read_back(CloudReader& reader) {
  std::vector<CloudPoint> all;
  std::vector<CloudPoint> batch;
  while (reader.read(batch)) all.insert(all.end(), batch.begin(), batch.end());
  return all;
}

std::vector<CloudPoint> read_back(const std::string& path) {
  return read_back(*open_cloud(path));
}

TEST(CloudWriter, WhatIsWrittenReadsBackInEveryFormat) {
  const TemporaryFolder folder;
  for (const char* name : {"a.pcd", "a.ply", "a.las"}) {
    SCOPED_TRACE(name);
    auto writer = write_cloud(OutputFile(folder / name), {.intensity = true, .color = true});
    for (const CloudPoint& point : kWritten) writer->write(std::span(&point, 1));
    EXPECT_FALSE(std::filesystem::exists(folder / name));  // not before it is complete
    writer->commit();
    EXPECT_EQ(writer->loss(), "");
    const auto reader = open_cloud(folder / name);
    EXPECT_TRUE(reader->has_intensity());
    EXPECT_TRUE(reader->has_color());
    const auto points = read_back(folder / name);
    ASSERT_EQ(points.size(), kWritten.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_LT((points[i].position - kWritten[i].position).norm(), 1e-9);
      EXPECT_EQ(points[i].intensity, kWritten[i].intensity);
      EXPECT_EQ(points[i].color, kWritten[i].color);
    }
  }
}

/// All of a cloud with its raw columns, written as another.
void pass_on(const std::string& from, const std::string& to) {
  const auto reader = open_cloud(from);
  reader->keep_raw();
  CloudColumns columns{.intensity = reader->has_intensity()};
  columns.raw = reader->raw_columns();
  columns.shape = reader->shape();
  const auto writer = write_cloud(OutputFile(to), columns);
  std::vector<CloudPoint> points;
  while (reader->read(points)) writer->write(points, reader->raw());
  writer->commit();
}

TEST(CloudWriter, ColumnsOfScansPassThroughAsTheyAre) {
  const TemporaryFolder folder;
  // whole numbers of 64 bits, signed bytes, a field of three, padding
  write_file(folder / "a.pcd",
             "VERSION 0.7\nFIELDS x y z t intensity ring tilt _ hist stamp\n"
             "SIZE 4 4 4 8 4 2 1 1 4 8\nTYPE F F F U F U I U F F\nCOUNT 1 1 1 1 1 1 1 1 3 1\n"
             "WIDTH 2\nHEIGHT 2\nPOINTS 4\nDATA ascii\n"
             "1 2 3 1700000000123456789 10 4 -3 0 1 2 3 0.125\n"
             "nan nan nan 18446744073709551615 0 65535 127 0 1 2 3 -1e300\n"
             "4 5 6 0 11 5 -128 0 1 2 3 2.5\n7 8 9 1 12 6 0 0 1 2 3 0\n");
  pass_on(folder / "a.pcd", folder / "b.pcd");
  const std::string binary = read_file(folder / "b.pcd");
  expect_contains(binary, "FIELDS x y z intensity t ring tilt stamp\nSIZE 4 4 4 4 8 2 1 8\n");
  expect_contains(binary, "TYPE F F F F U U I F\n");
  expect_contains(binary, "WIDTH 2\nHEIGHT 2\n");
  const auto reader = open_cloud(folder / "b.pcd");
  reader->keep_raw();
  std::vector<CloudPoint> points;
  ASSERT_TRUE(reader->read(points));
  ASSERT_EQ(points.size(), 4u);
  EXPECT_TRUE(std::isnan(points[1].position.x()));
  EXPECT_EQ(points[2].position, Vector3d(4, 5, 6));
  ASSERT_EQ(reader->raw().size(), 4u * 19u);
  std::uint64_t t = 0;
  std::memcpy(&t, reader->raw().data(), 8);
  EXPECT_EQ(t, 1'700'000'000'123'456'789u);
  std::memcpy(&t, reader->raw().data() + 19, 8);
  EXPECT_EQ(t, 18'446'744'073'709'551'615u);
  // once more: the same bytes
  pass_on(folder / "b.pcd", folder / "c.pcd");
  EXPECT_EQ(read_file(folder / "c.pcd"), binary);
  // PLY and back; what has no place there is said
  const auto scan = open_cloud(folder / "b.pcd");
  scan->keep_raw();
  const auto writer =
      write_cloud(OutputFile(folder / "d.ply"), {.intensity = true, .raw = scan->raw_columns()});
  while (scan->read(points)) writer->write(points, scan->raw());
  writer->commit();
  expect_contains(writer->loss(), "no whole numbers of 64 bits");
  expect_contains(read_file(folder / "d.ply"),
                  "property double t\nproperty ushort ring\nproperty char tilt\n"
                  "property double stamp\nend_header");
  pass_on(folder / "d.ply", folder / "e.ply");
  EXPECT_EQ(read_file(folder / "e.ply"), read_file(folder / "d.ply"));
  pass_on(folder / "d.ply", folder / "e.pcd");
  expect_contains(read_file(folder / "e.pcd"), "TYPE F F F F F U I F\n");
  const auto las = write_cloud(OutputFile(folder / "f.las"), {.raw = {{"ring", 'U', 2}}});
  expect_contains(las->loss(), "LAS has no place for ring");
}

TEST(CloudWriter, PlacesFarFromZeroKeepTheirMillimetres) {
  const TemporaryFolder folder;
  const CloudPoint far{{500000.1234, 5400000.4567, 300.7891}, 0.0f};
  for (const char* name : {"a.pcd", "a.ply", "a.las"}) {
    auto writer = write_cloud(OutputFile(folder / name), {});
    writer->write(std::span(&far, 1));
    writer->commit();
    EXPECT_LT((read_back(folder / name).at(0).position - far.position).norm(), 1e-4) << name;
  }
  // single precision was chosen by the first batch
  auto writer = write_cloud(OutputFile(folder / "b.pcd"), {});
  writer->write(std::span(kWritten));
  expect_contains(error_of([&] { writer->write(std::span(&far, 1)); }), "single precision");
}

TEST(CloudWriter, NormalsAndEllipsoidsHaveColumns) {
  const TemporaryFolder folder;
  CloudRow row;
  row.point = kWritten[0];
  row.normal = {0.0f, 0.6f, 0.8f};
  row.spread = {0.001f, 0.02f, 0.03f};
  row.surfel = 123456;
  for (const char* name : {"a.pcd", "a.ply"}) {
    auto writer = write_cloud(OutputFile(folder / name), {.normal = true, .ellipsoid = true});
    writer->write(std::span(&row, 1));
    writer->commit();
    const std::string bytes = read_file(folder / name);
    const std::array<float, 13> wanted = {
        1.5f, -2.25f, 3.0f, 0.0f, 0.6f, 0.8f, 0.001f, 0.02f, 0.03f, 1.0f, 0.0f, 0.0f, 0.0f};
    const std::size_t size = sizeof wanted + sizeof row.surfel;
    ASSERT_GT(bytes.size(), size);
    const char* last = &bytes[bytes.size() - size];
    EXPECT_EQ(std::memcmp(last, wanted.data(), sizeof wanted), 0);
    EXPECT_EQ(std::memcmp(last + sizeof wanted, &row.surfel, sizeof row.surfel), 0);
  }
  expect_contains(error_of([&] { write_cloud(OutputFile(folder / "a.las"), {.normal = true}); }),
                  "LAS");
}

TEST(CloudWriter, SaysWhatAFormatCannotHold) {
  const TemporaryFolder folder;
  auto writer = write_cloud(OutputFile(folder / "a.las"), {.intensity = true});
  const CloudPoint faint{{0, 0, 0}, 0.25f};
  writer->write(std::span(&faint, 1));
  writer->commit();
  expect_contains(writer->loss(), "whole numbers");
  const CloudPoint away{{400e3, 0, 0}, 0.0f};
  auto wide = write_cloud(OutputFile(folder / "b.las"), {});
  wide->write(std::span(&faint, 1));
  expect_contains(error_of([&] { wide->write(std::span(&away, 1)); }), "214 km");
  expect_contains(error_of([] { require_writable_cloud("a.xyz"); }), ".pcd, .ply or .las");
}

TEST(CloudWriter, AnEmptyCloudHasAHeader) {
  const TemporaryFolder folder;
  for (const char* name : {"a.pcd", "a.ply", "a.las"}) {
    write_cloud(OutputFile(folder / name), {})->commit();
    EXPECT_TRUE(read_back(folder / name).empty()) << name;
  }
}

TEST(Colors, OfPclAndOfPlyWithFloats) {
  const TemporaryFolder folder;
  // PCL's float of the bits 0x00ff8001
  write_file(folder / "a.pcd",
             "VERSION 0.7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F F\nWIDTH 1\nHEIGHT 1\n"
             "POINTS 1\nDATA ascii\n1 2 3 2.346397066966522e-38\n");
  const auto pcd = read_back(folder / "a.pcd").at(0);
  EXPECT_EQ(pcd.color, (std::array<std::uint8_t, 3>{0xff, 0x80, 0x01}));
  write_file(folder / "a.ply",
             "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
             "property float z\nproperty float red\nproperty float green\nproperty float blue\n"
             "end_header\n1 2 3 1 0.5 0\n");
  EXPECT_EQ(read_back(folder / "a.ply").at(0).color, (std::array<std::uint8_t, 3>{255, 128, 0}));
  EXPECT_FALSE(open_cloud(folder / "a.ply")->has_intensity());
  EXPECT_NEAR(static_cast<double>(luminance({{}, 0.0f, {255, 128, 0}})), 151.4, 0.1);
}

TEST(Units, InComments) {
  const auto metres = [](const char* comment) {
    const auto unit = unit_in_comment(comment);
    return unit ? unit->metres : -1.0;
  };
  EXPECT_EQ(metres("units: mm"), 0.001);
  EXPECT_EQ(metres(" File units = millimeters"), 0.001);
  EXPECT_EQ(metres("Unit is cm"), 0.01);
  EXPECT_EQ(metres("UNITS METERS"), 1.0);
  EXPECT_EQ(metres("unit feet"), 0.3048);
  EXPECT_EQ(metres("unit"), -1.0);
  EXPECT_EQ(metres("a unit sphere"), -1.0);
  EXPECT_EQ(metres("made by someone in 2020"), -1.0);
}

std::string las_record(const std::string& user, std::uint16_t id, const std::string& body) {
  std::string record(54, '\0');
  record.replace(2, user.size(), user);
  const auto length = static_cast<std::uint16_t>(body.size());
  std::memcpy(&record[18], &id, 2);
  std::memcpy(&record[20], &length, 2);
  return record + body;
}

std::string geo_keys(std::initializer_list<std::array<std::uint16_t, 2>> keys) {
  std::string bytes;
  const auto put = [&](std::uint16_t value) {
    bytes.append(reinterpret_cast<const char*>(&value), 2);
  };
  for (const int value : {1, 1, 0, static_cast<int>(keys.size())}) {
    put(static_cast<std::uint16_t>(value));
  }
  for (const auto& [key, value] : keys) {
    put(key);
    put(0);
    put(1);
    put(value);
  }
  return bytes;
}

TEST(Units, InLasRecords) {
  const auto unit = [](const std::string& records, std::size_t count) {
    return unit_in_las_records(std::as_bytes(std::span(records.data(), records.size())), count);
  };
  const std::string other = las_record("someone", 7, "text");
  const std::string feet =
      las_record("LASF_Projection", 34735, geo_keys({{1024, 1}, {3076, 9003}}));
  EXPECT_NEAR(unit(other + feet, 2)->metres, 0.3048006, 1e-7);
  EXPECT_FALSE(unit(other + feet, 1));
  const std::string degrees = las_record("LASF_Projection", 34735, geo_keys({{1024, 2}}));
  EXPECT_EQ(unit(degrees, 1)->metres, 0.0);
  const std::string text = las_record("LASF_Projection",
                                      2112,
                                      "PROJCS[\"x\",GEOGCS[\"y\",UNIT[\"degree\",0.0174532925]],"
                                      "UNIT[\"US survey foot\",0.304800609601]]");
  EXPECT_NEAR(unit(text, 1)->metres, 0.3048006, 1e-7);
  EXPECT_FALSE(unit(text.substr(0, 60), 1));  // cut off
}

TEST(CloudSource, AStreamIsKeptAndKnownByItsFirstBytes) {
  const TemporaryFolder folder;
  const auto stream = [&](const std::string& bytes, const std::string& format = "") {
    int ends[2];
    EXPECT_EQ(::pipe2(ends, O_CLOEXEC), 0);
    std::thread feeder([&] {
      std::size_t at = 0;
      while (at < bytes.size()) {
        const ssize_t n = ::write(ends[1], bytes.data() + at, bytes.size() - at);
        if (n <= 0) break;
        at += static_cast<std::size_t>(n);
      }
      ::close(ends[1]);
    });
    struct Join {
      std::thread& thread;
      int end;
      ~Join() {
        ::close(end);
        thread.join();
      }
    } const join{feeder, ends[0]};
    return CloudSource::from_stream(ends[0], format, folder.path());
  };
  std::signal(SIGPIPE, SIG_IGN);
  for (const char* name : {"a.pcd", "a.ply", "a.las"}) {
    auto writer = write_cloud(OutputFile(folder / name), {});
    writer->write(std::span(kWritten));
    writer->commit();
    const CloudSource source = stream(read_file(folder / name));
    for (int pass = 0; pass < 2; ++pass) {
      const auto reader = source.open();
      EXPECT_EQ(read_back(*reader).size(), 3u) << name;
    }
  }
  std::string text;
  for (int i = 0; i < 100'000; ++i) text += "1 2 3\n";
  const auto reader = stream(text).open();
  EXPECT_EQ(read_back(*reader).size(), 100'000u);
  const auto named = stream("1 2 3\n", "xyz").open();
  EXPECT_EQ(read_back(*named).size(), 1u);
  expect_contains(error_of([&] { stream(""); }), "nothing came");
  expect_contains(error_of([&] { stream(std::string("\1\2\3\4", 4)); }), "--format");
  expect_contains(error_of([&] { (void)stream("ASTM-E57 and more").open(); }), "E57 header");
  expect_contains(error_of([&] { stream("x", "obj"); }), "--format obj");
  expect_contains(error_of([&] { stream("x", "laz"); }), "LAZ");
  expect_contains(error_of([&] {
                    stream(
                        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float "
                        "y\nproperty float z\nelement face 1\nproperty list uchar int "
                        "vertex_indices\nend_header\n0 0 0\n3 0 0 0\n");
                  }),
                  "mesh");
}

TEST(CloudSource, AFormatCountsInsteadOfTheName) {
  const TemporaryFolder folder;
  write_file(folder / "scan.dat", "1 2 3\n4 5 6\n");
  const CloudSource source(folder / "scan.dat", "xyz");
  const auto reader = source.open();
  EXPECT_EQ(read_back(*reader).size(), 2u);
}

TEST(MappedFile, RefusesWhatIsNoRegularFileWithoutWaiting) {
  const TemporaryFolder folder;
  ASSERT_EQ(::mkfifo((folder / "pipe.pcd").c_str(), 0600), 0);
  expect_contains(error_of([&] { MappedFile(folder / "pipe.pcd"); }), "not a regular file");
  expect_contains(error_of([&] { open_cloud(folder / "pipe.pcd"); }), "give - instead");
  expect_contains(error_of([] { MappedFile("/dev/zero"); }), "not a regular file");
  expect_contains(error_of([&] { MappedFile(folder.path()); }), "not a regular file");
  expect_contains(error_of([&] { require_regular_file(folder / "absent"); }), "No such file");
}

}  // namespace
}  // namespace pointflight
