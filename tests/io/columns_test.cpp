// What columns of files mean, by their names and by what stands in them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "pointflight/io/internal/column_names.hpp"
#include "tests/io/clouds.hpp"
#include "tests/io/numpy_files.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::bytes_of;
using testing::error_of;
using testing::expect_contains;
using testing::expect_points;
using testing::npy;
using testing::read_all;
using testing::TemporaryFolder;
using testing::write_file;
using testing::write_npz;

using Names = std::vector<std::string>;

std::string intensity_of(const Names& names) {
  return NamedColumns(names).about().intensity;
}

TEST(NamedColumns, IntensityHasManyNames) {
  for (const char* name : {"intensity",
                           "Intensity",
                           "INTENSITY",
                           "i",
                           "I",
                           "reflectivity",
                           "Reflectance",
                           "scalar_Intensity",
                           "scalar_Reflectance",
                           "scalar_reflectivity",
                           "scalar_Scalar_field",
                           "amplitude"}) {
    EXPECT_EQ(intensity_of({"x", "y", "z", name}), name);
  }
  EXPECT_EQ(intensity_of({"x", "y", "z", "reflectivity", "intensity"}), "intensity")
      << "the usual name, wherever it stands";
  for (const char* name : {"scalar_GPSTime",
                           "scalar_Classification",
                           "scalar_Number_Of_Returns",
                           "scalar_C2C_absolute_distances",
                           "label",
                           "nx"}) {
    EXPECT_EQ(intensity_of({"x", "y", "z", name}), "") << name;
  }
  EXPECT_EQ(intensity_of({"x", "y", "z", "scalar_foo", "scalar_bar"}), "") << "which of them?";
}

TEST(NamedColumns, WhatIsLeftOutIsListed) {
  const NamedColumns columns(
      {"X", "Y", "Z", "normal_x", "Ring", "time", "_", "rgb", "curvature", "intensity"});
  EXPECT_TRUE(columns.has_position());
  EXPECT_EQ(columns.about().left_out, (Names{"normal_x", "curvature"}));
  EXPECT_EQ(columns.about().of_scans, (Names{"time", "Ring"}));
  EXPECT_FALSE(NamedColumns({"x", "y", "w"}).has_position());
}

std::string pcd(const std::string& fields, const std::string& types, const std::string& rest = "") {
  return fmt::format(
      "VERSION .7\nFIELDS {}\nSIZE 4 4 4 4\nTYPE {}\n{}WIDTH 3\nHEIGHT 1\nPOINTS "
      "3\nDATA ascii\n1.5 -2.25 3 10\n0 0.5 -0.125 20\n-7 8 9.5 30\n",
      fields,
      types,
      rest);
}

TEST(Pcd, NamesAndTypesInAnyCase) {
  const TemporaryFolder folder;
  write_file(folder / "a.pcd", pcd("X Y Z Intensity", "f f f f"));
  expect_points(read_all(folder / "a.pcd"), true);
  write_file(folder / "b.pcd", pcd("x y z reflectivity", "F f F U"));
  expect_points(read_all(folder / "b.pcd"), true);
  EXPECT_EQ(open_cloud(folder / "b.pcd")->columns().intensity, "reflectivity");
  write_file(folder / "c.pcd", pcd("x y z i", "F F F D"));
  expect_contains(error_of([&] { read_all(folder / "c.pcd"); }), "TYPE 'D' is unknown");
}

TEST(Pcd, AViewpointThatIsNotAppliedIsSaid) {
  const TemporaryFolder folder;
  write_file(folder / "a.pcd", pcd("x y z i", "F F F F", "VIEWPOINT 0 0 0 1 0 0 0\n"));
  EXPECT_TRUE(open_cloud(folder / "a.pcd")->columns().notes.empty());
  write_file(folder / "b.pcd", pcd("x y z i", "F F F F", "VIEWPOINT 0 0 1.5 1 0 0 0\n"));
  const auto notes = open_cloud(folder / "b.pcd")->columns().notes;
  ASSERT_EQ(notes.size(), 1u);
  expect_contains(notes.front(), "VIEWPOINT 0 0 1.5 1 0 0 0 is not applied");
}

TEST(Ply, IntensityUnderOtherNames) {
  const TemporaryFolder folder;
  for (const char* name : {"scalar_Reflectance", "reflectivity", "I"}) {
    write_file(folder / "a.ply",
               fmt::format("ply\nformat ascii 1.0\nelement vertex 3\nproperty float X\nproperty "
                           "float Y\nproperty float Z\nproperty float {}\nend_header\n1.5 -2.25 3 "
                           "10\n0 0.5 -0.125 20\n-7 8 9.5 30\n",
                           name));
    expect_points(read_all(folder / "a.ply"), true);
  }
}

struct Row {
  std::string intensity;  // of the first point
  std::string color;
};

Row first_row(const std::string& name, const std::string& text) {
  const TemporaryFolder folder;
  write_file(folder / name, text);
  const auto reader = open_cloud(folder / name);
  std::vector<CloudPoint> batch;
  EXPECT_TRUE(reader->read(batch));
  const auto& color = batch.at(0).color;
  return {reader->has_intensity() ? fmt::format("{}", batch[0].intensity) : "none",
          reader->has_color() ? fmt::format("{} {} {}", color[0], color[1], color[2]) : "none"};
}

TEST(Xyz, ColumnsWithoutNamesAreToldByWhatStandsInThem) {
  const auto is = [](const Row& row, const char* intensity, const char* color) {
    EXPECT_EQ(row.intensity, intensity);
    EXPECT_EQ(row.color, color);
  };
  is(first_row("a.txt", "1 2 3 0.5\n"), "0.5", "none");
  is(first_row("a.txt", "1 2 3 255 7 9\n4 5 6 0 0 0\n"), "none", "255 7 9");
  is(first_row("a.txt", "1 2 3 0.1 0.2 0.97\n"), "none", "none");  // normals
  is(first_row("a.txt", "1 2 3 255 7 9 0.5\n"), "0.5", "255 7 9");
  is(first_row("a.txt", "1 2 3 0.5 255 7 9\n"), "0.5", "255 7 9");
  is(first_row("a.txt", "1 2 3 1000 255 7 9\n"), "1000", "255 7 9");
  is(first_row("a.pts", "1\n1 2 3 100 255 7 9\n"), "100", "255 7 9");
  is(first_row("a.txt", "1 2 3 0.5 0.1 0.2 0.3\n"), "none", "none");
  is(first_row("a.csv", "x,y,z,R,G,B,Reflectance\n1,2,3,255,7,9,50\n"), "50", "255 7 9");
}

TEST(Xyz, WhatWasGuessedIsSaid) {
  const TemporaryFolder folder;
  const auto note = [&](const char* text) {
    write_file(folder / "a.txt", text);
    const auto notes = open_cloud(folder / "a.txt")->columns().notes;
    return notes.empty() ? std::string() : notes.front();
  };
  expect_contains(note("1 2 3 255 0 0 0\n"), "read as x y z red green blue intensity");
  expect_contains(note("1 2 3 7\n"), "read as x y z intensity");
  expect_contains(note("1 2 3 0.1 0.2\n"), "of its 5 columns, which have no names, the first 3");
  EXPECT_EQ(note("1 2 3\n"), "");
  EXPECT_EQ(note("# x y z intensity\n1 2 3 4\n"), "");
}

TEST(KittiBin, FourNumbersOrFive) {
  const TemporaryFolder folder;
  write_file(folder / "a.bin",
             bytes_of<float>({1.5, -2.25, 3, 10, 0, 0.5, -0.125, 20, -7, 8, 9.5, 30}));
  expect_points(read_all(folder / "a.bin"), true);
  std::vector<float> five;
  for (int i = 0; i < 20; ++i) {
    for (const float v : {1.25f * static_cast<float>(i), 2.5f, -1.0f, 7.0f}) five.push_back(v);
    five.push_back(static_cast<float>(i % 16));
  }
  write_file(folder / "b.pcd.bin", bytes_of(five));
  const auto reader = open_cloud(folder / "b.pcd.bin");
  std::vector<CloudPoint> batch;
  ASSERT_TRUE(reader->read(batch));
  EXPECT_EQ(batch.size(), 20u);
  EXPECT_EQ(reader->rings()[17], 1);
  EXPECT_EQ(batch[17].intensity, 7.0f);
  write_file(folder / "c.bin", "something else than points, 32 B");
  expect_contains(error_of([&] { read_all(folder / "c.bin"); }), "does not look like KITTI's");
  write_file(folder / "d.bin", std::string(16 * 100, '\0'));
  expect_contains(error_of([&] { read_all(folder / "d.bin"); }), "does not look like KITTI's");
}

TEST(Npy, ArraysOfAllOrders) {
  const TemporaryFolder folder;
  const auto read = [&](const std::string& header, const std::string& data) {
    write_file(folder / "a.npy", npy(header, data));
    return read_all(folder / "a.npy");
  };
  expect_points(read("{'descr': '<f4', 'fortran_order': False, 'shape': (3, 4), }",
                     bytes_of<float>({1.5, -2.25, 3, 10, 0, 0.5, -0.125, 20, -7, 8, 9.5, 30})),
                true);
  expect_points(read("{'descr': '<f8', 'fortran_order': True, 'shape': (3, 3), }",
                     bytes_of<double>({1.5, 0, -7, -2.25, 0.5, 8, 3, -0.125, 9.5})),
                false);
  EXPECT_EQ(read("{'descr': '<i2', 'fortran_order': False, 'shape': (2, 2, 3), }",
                 bytes_of<std::int16_t>({1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, -12}))
                .at(3)
                .position,
            Vector3d(10, 11, -12))
      << "organised";
  std::string rows;
  for (const CloudPoint& p : testing::kPoints) {
    rows += bytes_of<double>({p.position.z()}) + bytes_of<float>({p.intensity}) + "\x07" +
            bytes_of<double>({p.position.x(), p.position.y()});
  }
  expect_points(read("{'descr': [('z', '<f8'), ('reflectivity', '<f4'), ('tag', '|u1'), "
                     "('x', '<f8'), ('y', '<f8')], 'fortran_order': False, 'shape': (3,), }",
                     rows),
                true);
  std::string big(12, '\0');
  big[0] = '\x3f';  // 1.0f, 0, 0
  big[1] = '\x80';
  EXPECT_EQ(read("{'descr': '>f4', 'fortran_order': False, 'shape': (1, 3), }", big)[0].position,
            Vector3d(1, 0, 0));
}

TEST(Npy, BadFilesSayWhat) {
  const TemporaryFolder folder;
  const auto error = [&](const std::string& header, const std::string& data = "") {
    write_file(folder / "a.npy", npy(header, data));
    return error_of([&] { read_all(folder / "a.npy"); });
  };
  expect_contains(error("{'descr': '<f4', 'fortran_order': False, 'shape': (3, 4), }"),
                  "promises 3 rows of 16 bytes, the file has 0");
  expect_contains(error("{'descr': '<f4', 'fortran_order': False, 'shape': (3,), }"),
                  "its shape is (3)");
  expect_contains(error("{'descr': '|O', 'fortran_order': False, 'shape': (3, 3), }"), "'|O'");
  expect_contains(error("{'descr': '<c8', 'fortran_order': False, 'shape': (3, 3), }"), "'<c8'");
  expect_contains(error("{'descr': '<i-4', 'fortran_order': False, 'shape': (3, 3), }"), "'<i-4'");
  expect_contains(error("{'descr': '<f1e99', 'fortran_order': False, 'shape': (3, 3), }"),
                  "'<f1e99'");
  expect_contains(
      error("{'descr': '<f4', 'fortran_order': False, 'shape': (4194304, 4398046511104, 3), }"),
      "its shape cannot be read");
  expect_contains(error("{'fortran_order': False, 'shape': (3, 3), }"), "lacks 'descr'");
  expect_contains(error("{'descr': [('a', '<f4')], 'fortran_order': False, 'shape': (0,), }"),
                  "no fields x, y and z; it has: a");
  write_file(folder / "b.npy", "PK and so on");
  expect_contains(error_of([&] { read_all(folder / "b.npy"); }), "does not begin as NumPy's");
}

TEST(Npz, TheArrayOfPointsIsTaken) {
  const TemporaryFolder folder;
  const std::string points =
      npy("{'descr': '<f4', 'fortran_order': False, 'shape': (3, 4), }",
          bytes_of<float>({1.5, -2.25, 3, 10, 0, 0.5, -0.125, 20, -7, 8, 9.5, 30}));
  const std::string labels =
      npy("{'descr': '<i4', 'fortran_order': False, 'shape': (1,), }", std::string("\1\0\0\0", 4));
  const std::string others = npy("{'descr': '<f4', 'fortran_order': False, 'shape': (1, 3), }",
                                 bytes_of<float>({1, 2, 3}));
  write_npz(folder / "a.npz",
            {{"colors.npy", others}, {"labels.npy", labels}, {"points.npy", points}});
  expect_points(read_all(folder / "a.npz"), true);
  const FileColumns columns = open_cloud(folder / "a.npz")->columns();
  ASSERT_EQ(columns.notes.size(), 1u);
  EXPECT_EQ(columns.notes[0], "its array points.npy is taken; left out: colors.npy, labels.npy");
  write_npz(folder / "b.npz", {{"arr_0.npy", labels}, {"arr_1.npy", points}});
  expect_points(read_all(folder / "b.npz"), true);
  write_npz(folder / "c.npz", {{"arr_0.npy", labels}});
  expect_contains(error_of([&] { read_all(folder / "c.npz"); }), "c.npz: arr_0.npy: its shape");
  write_npz(folder / "d.npz", {{"readme.txt", "x"}});
  expect_contains(error_of([&] { read_all(folder / "d.npz"); }), "has no array (.npy) in it");
  write_file(folder / "e.npz", "no archive");
  expect_contains(error_of([&] { read_all(folder / "e.npz"); }), "is no zip archive of arrays");
  write_npz(folder / "f.npz", {{"points.npy", points}});
  std::string cut = testing::read_file(folder / "f.npz");
  cut[60] = static_cast<char>(cut[60] ^ '\x55');
  write_file(folder / "f.npz", cut);
  expect_contains(error_of([&] { read_all(folder / "f.npz"); }),
                  "f.npz: points.npy: does not unpack");
}

TEST(Ptx, ScansStandWhereTheirMatrixSays) {
  const TemporaryFolder folder;
  const std::string axes = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
  write_file(folder / "a.ptx",
             "2\n1\n" + axes + "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1.5 -2.25 3 10\n0 0 0 0.5\n" +
                 "1\n2\n" + axes +
                 "0 1 0 0\n-1 0 0 0\n0 0 1 0\n100 200 5 1\n1 2 3 0.25 9 8 7\n4 5 6 0.5 1 2 3\n");
  const auto reader = open_cloud(folder / "a.ptx");
  std::vector<CloudPoint> points;
  ASSERT_TRUE(reader->read(points));
  ASSERT_EQ(points.size(), 3u);
  EXPECT_EQ(points[0].position, Vector3d(1.5, -2.25, 3));
  // a quarter turn to the left, and moved
  EXPECT_EQ(points[1].position, Vector3d(98, 201, 8));
  EXPECT_EQ(points[1].intensity, 0.25f);
  expect_contains(reader->columns().notes.at(0), "1 beams without a return");
  write_file(folder / "b.ptx", "2\n1\n" + axes + "1 0 0 0\n");
  expect_contains(error_of([&] { read_all(folder / "b.ptx"); }), "amid a scan's header");
  write_file(folder / "c.ptx", "1 2 3 4\n");
  expect_contains(error_of([&] { read_all(folder / "c.ptx"); }), "c.ptx:1:");
}

TEST(Obj, WithoutFacesItsVerticesArePoints) {
  const TemporaryFolder folder;
  write_file(folder / "a.obj", "# a cloud\nv 1.5 -2.25 3\nv 0 0.5 -0.125\nv -7 8 9.5\n");
  expect_points(read_all(folder / "a.obj"), false);
  EXPECT_FALSE(is_mesh(folder / "a.obj"));
  write_file(folder / "b.obj", "v 1 2 3 1.0 0.5 0.0\n");
  EXPECT_EQ(read_all(folder / "b.obj").at(0).color, (std::array<std::uint8_t, 3>{255, 128, 0}));
}

}  // namespace
}  // namespace pointflight
