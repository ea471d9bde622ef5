// Damaged meshes make the importer library crash; here they are errors of one line.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <utility>

#include "pointflight/core/random.hpp"
#include "pointflight/io/formats.hpp"
#include "pointflight/io/internal/mesh_triangles.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;
using testing::TemporaryFolder;
using testing::write_file;

constexpr MeshLimits kShort{1.0, std::size_t{200} << 20};

template <class T>
void put_raw(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

struct Seed {
  std::string extension;
  std::string bytes;
};

/// A pyramid in the formats that are read.
constexpr float kCorners[5][3] = {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}, {1, 1, 3}};
constexpr int kFaces[6][3] = {{0, 2, 1}, {0, 3, 2}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};

std::string obj() {
  std::string text = "# a pyramid\no pyramid\n";
  for (const auto& c : kCorners) text += fmt::format("v {} {} {}\n", c[0], c[1], c[2]);
  text += "vn 0 0 1\nvt 0 0\nusemtl none\ns off\n";
  for (const auto& f : kFaces) {
    text += fmt::format("f {}/1/1 {}/1/1 {}/1/1\n", f[0] + 1, f[1] + 1, f[2] + 1);
  }
  return text;
}

std::string stl(bool ascii) {
  std::string bytes = ascii ? "solid pyramid\n" : std::string(80, ' ');
  if (!ascii) put_raw(bytes, std::uint32_t{6});
  for (const auto& f : kFaces) {
    if (ascii) bytes += "facet normal 0 0 1\nouter loop\n";
    if (!ascii) bytes += std::string(12, '\0');
    for (const int corner : f) {
      for (const float c : kCorners[corner]) {
        if (!ascii) put_raw(bytes, c);
      }
      const auto& c = kCorners[corner];
      if (ascii) bytes += fmt::format("vertex {} {} {}\n", c[0], c[1], c[2]);
    }
    bytes += ascii ? std::string("endloop\nendfacet\n") : std::string(2, '\0');
  }
  return bytes + (ascii ? "endsolid pyramid\n" : "");
}

std::string ply(bool ascii) {
  std::string bytes = fmt::format(
      "ply\nformat {} 1.0\nelement vertex 5\nproperty float x\nproperty float y\n"
      "property float z\nelement face 6\nproperty list uchar int vertex_indices\nend_header\n",
      ascii ? "ascii" : "binary_little_endian");
  for (const auto& c : kCorners) {
    if (ascii) bytes += fmt::format("{} {} {}\n", c[0], c[1], c[2]);
    for (const float value : c) {
      if (!ascii) put_raw(bytes, value);
    }
  }
  for (const auto& f : kFaces) {
    if (ascii) bytes += fmt::format("3 {} {} {}\n", f[0], f[1], f[2]);
    if (!ascii) put_raw(bytes, std::uint8_t{3});
    for (const std::int32_t value : f) {
      if (!ascii) put_raw(bytes, value);
    }
  }
  return bytes;
}

std::string dae(const std::string& nodes = "<instance_geometry url=\"#g\"/>") {
  std::string places;
  std::string faces;
  for (const auto& c : kCorners) places += fmt::format("{} {} {} ", c[0], c[1], c[2]);
  for (const auto& f : kFaces) faces += fmt::format("{} {} {} ", f[0], f[1], f[2]);
  return fmt::format(
      "<?xml version=\"1.0\"?>\n<COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" "
      "version=\"1.4.1\">\n<asset><unit meter=\"1\"/><up_axis>Z_UP</up_axis></asset>\n"
      "<library_geometries><geometry id=\"g\"><mesh><source id=\"p\"><float_array id=\"a\" "
      "count=\"15\">{}</float_array><technique_common><accessor source=\"#a\" count=\"5\" "
      "stride=\"3\"><param name=\"X\" type=\"float\"/><param name=\"Y\" type=\"float\"/><param "
      "name=\"Z\" type=\"float\"/></accessor></technique_common></source><vertices id=\"v\"><input "
      "semantic=\"POSITION\" source=\"#p\"/></vertices><triangles count=\"6\"><input "
      "semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/><p>{}</p></triangles></mesh></geometry>"
      "</library_geometries>\n<library_visual_scenes><visual_scene id=\"s\"><node id=\"n\">{}"
      "</node></visual_scene></library_visual_scenes>\n<scene><instance_visual_scene "
      "url=\"#s\"/></scene>\n</COLLADA>\n",
      places,
      faces,
      nodes);
}

std::string gltf_json(const std::string& uri) {
  return fmt::format(
      "{{\"asset\":{{\"version\":\"2.0\"}},\"scene\":0,\"scenes\":[{{\"nodes\":[0]}}],\"nodes\":["
      "{{\"mesh\":0}}],\"meshes\":[{{\"primitives\":[{{\"attributes\":{{\"POSITION\":1}},"
      "\"indices\":0}}]}}],\"buffers\":[{{{}\"byteLength\":96}}],\"bufferViews\":[{{\"buffer\":0,"
      "\"byteOffset\":0,\"byteLength\":36}},{{\"buffer\":0,\"byteOffset\":36,\"byteLength\":60}}],"
      "\"accessors\":[{{\"bufferView\":0,\"componentType\":5123,\"count\":18,\"type\":\"SCALAR\"}},"
      "{{\"bufferView\":1,\"componentType\":5126,\"count\":5,\"type\":\"VEC3\",\"min\":[0,0,0],"
      "\"max\":[2,2,3]}}]}}",
      uri);
}

std::string gltf_buffer() {
  std::string bytes;
  for (const auto& f : kFaces) {
    for (const int index : f) put_raw(bytes, static_cast<std::uint16_t>(index));
  }
  for (const auto& corner : kCorners) {
    for (const float c : corner) put_raw(bytes, c);
  }
  return bytes;
}

std::string base64(const std::string& bytes) {
  constexpr const char* kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i + 2 < bytes.size(); i += 3) {  // a multiple of three bytes
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k) bits = bits << 8 | static_cast<std::uint8_t>(bytes[i + k]);
    for (int shift = 18; shift >= 0; shift -= 6) text += kDigits[bits >> shift & 63u];
  }
  return text;
}

std::string glb() {
  std::string json = gltf_json("");
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const std::string buffer = gltf_buffer();
  std::string bytes = "glTF";
  put_raw(bytes, std::uint32_t{2});
  put_raw(bytes, static_cast<std::uint32_t>(12 + 8 + json.size() + 8 + buffer.size()));
  put_raw(bytes, static_cast<std::uint32_t>(json.size()));
  bytes += "JSON" + json;
  put_raw(bytes, static_cast<std::uint32_t>(buffer.size()));
  return bytes + std::string("BIN\0", 4) + buffer;
}

std::vector<Seed> seeds() {
  const std::string uri =
      "\"uri\":\"data:application/octet-stream;base64," + base64(gltf_buffer()) + "\",";
  return {{".obj", obj()},
          {".stl", stl(true)},
          {".stl", stl(false)},
          {".ply", ply(true)},
          {".ply", ply(false)},
          {".dae", dae()},
          {".gltf", gltf_json(uri)},
          {".glb", glb()}};
}

std::size_t points_in(const std::string& path) {
  MeshSampling sampling;
  sampling.points_per_square_metre = 100.0;
  const std::string format = path.substr(path.rfind('.'));
  const auto reader = open_mesh(path, format, sampling, kShort);
  std::vector<CloudPoint> batch;
  std::size_t count = 0;
  while (count < 1'000'000 && reader->read(batch)) count += batch.size();
  return count;
}

/// False if the program was built without assimp.
bool reads_meshes() {
  static const bool reads = [] {
    const TemporaryFolder folder;
    write_file(folder / "a.stl", stl(true));
    try {
      return points_in(folder / "a.stl") > 0;
    } catch (const InputError& error) {
      expect_contains(error.what(), "libassimp-dev");
      return false;
    }
  }();
  return reads;
}

/// A few positions changed: bits, bytes, cuts, words that are too large, pieces twice.
std::string mutant_of(const std::string& seed, std::uint32_t number) {
  const RandomStream random(number, StreamId::kCloudSampling, 0);
  std::uint64_t drawn = 0;
  const auto draw = [&](std::size_t below) {
    return static_cast<std::size_t>(random.uniform2(drawn++)[0] * static_cast<double>(below));
  };
  std::string bytes = seed;
  for (std::size_t changes = 1 + draw(3); changes > 0 && !bytes.empty(); --changes) {
    const std::size_t at = draw(bytes.size());
    switch (draw(6)) {
      case 0:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << draw(8)));
        break;
      case 1:
        bytes[at] = static_cast<char>(draw(256));
        break;
      case 2:
        bytes.resize(at);
        break;
      case 3:
        bytes.erase(at, 1 + draw(20));
        break;
      case 4:
        bytes.insert(at, bytes.substr(draw(bytes.size()), draw(40)));
        break;
      default:
        constexpr const char* kWords[] = {"-1", "4294967295", "0", "1e38", "nan", "999999999999"};
        const std::size_t digit = bytes.find_first_of("0123456789", at);
        if (digit != std::string::npos) bytes.replace(digit, 1, kWords[draw(6)]);
    }
  }
  return bytes;
}

TEST(Mesh, EveryFormatGivesTheSameSurface) {
  if (!reads_meshes()) GTEST_SKIP() << "built without assimp";
  const TemporaryFolder folder;
  // a square of 4 m^2 and four triangles of sqrt(10) m^2
  const double wanted = 100.0 * (4.0 + 4.0 * std::sqrt(10.0));
  for (const Seed& seed : seeds()) {
    SCOPED_TRACE(seed.extension);
    write_file(folder / ("a" + seed.extension), seed.bytes);
    EXPECT_NEAR(static_cast<double>(points_in(folder / ("a" + seed.extension))), wanted, 1.5);
  }
}

TEST(Mesh, DamagedFilesAreErrorsOfOneLine) {
  if (!reads_meshes()) GTEST_SKIP() << "built without assimp";
  const TemporaryFolder folder;
  int refused = 0;
  for (const Seed& seed : seeds()) {
    for (std::uint32_t number = 0; number < testing::repeats(40u); ++number) {
      SCOPED_TRACE(fmt::format("{} {}", seed.extension, number));
      const std::string path = folder / ("a" + seed.extension);
      write_file(path, mutant_of(seed.bytes, number));
      try {
        points_in(path);
      } catch (const InputError& error) {
        const std::string what = error.what();
        EXPECT_EQ(what.rfind(path, 0), 0u) << what;
        EXPECT_EQ(what.find('\n'), std::string::npos) << what;
        ++refused;
      }
    }
  }
  EXPECT_GT(refused, testing::repeats(80));
}

TEST(Mesh, WhatCrashedTheImporterIsAnError) {
  if (!reads_meshes()) GTEST_SKIP() << "built without assimp";
  const TemporaryFolder folder;
  std::string deep;
  for (int i = 0; i < 200'000; ++i) deep += "<node>";
  for (int i = 0; i < 200'000; ++i) deep += "</node>";
  const Seed cases[] = {
      {"self.dae", dae("<instance_geometry url=\"#g\"/><instance_node url=\"#n\"/>")},
      {"deep.dae", dae(deep)},
  };
  for (const auto& [name, bytes] : cases) {
    SCOPED_TRACE(name);
    write_file(folder / name, bytes);
    std::string what;
    try {
      points_in(folder / name);
    } catch (const InputError& error) {
      what = error.what();
    }
    EXPECT_EQ(what.find('\n'), std::string::npos) << what;
    EXPECT_FALSE(what.empty());
  }
}

TEST(Mesh, ItsCompanionsAreFilesOrNothing) {
  if (!reads_meshes()) GTEST_SKIP() << "built without assimp";
  const TemporaryFolder folder;
  ASSERT_EQ(::mkfifo((folder / "pipe.bin").c_str(), 0600), 0);
  write_file(folder / "a.gltf", gltf_json("\"uri\":\"pipe.bin\","));
  EXPECT_NE(error_of([&] { points_in(folder / "a.gltf"); }), "") << "and it does not wait";
}

TEST(Mesh, WithoutFacesOrAMeshAtAll) {
  const TemporaryFolder folder;
  write_file(folder / "a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\n");
  expect_contains(error_of([&] { points_in(folder / "a.obj"); }), "a.obj: the mesh has no faces");
}

/// Area that the points stand for, m^2.
double area_of(const TemporaryFolder& folder, const std::string& name, const std::string& bytes) {
  write_file(folder / name, bytes);
  return static_cast<double>(points_in(folder / name)) / 100.0;
}

const std::string kPlyHead = "ply\nformat ascii 1.0\n";
const std::string kXyz = "property float x\nproperty float y\nproperty float z\n";

TEST(Mesh, PlyOfAllShapes) {
  const TemporaryFolder folder;
  const auto area = [&](const std::string& bytes) { return area_of(folder, "a.ply", bytes); };
  const std::string six = "0 0 0\n0 8 0\n5 0 0\n5 8 0\n10 0 0\n10 8 0\n";
  EXPECT_NEAR(area(kPlyHead + "element vertex 6\n" + kXyz +
                   "element tristrips 1\nproperty list int int vertex_indices\nend_header\n" + six +
                   "6 0 1 2 3 4 5\n"),
              80.0,
              0.02)
      << "a strip, whole";
  EXPECT_NEAR(area(kPlyHead + "element vertex 6\n" + kXyz +
                   "element tristrips 1\nproperty list int int vertex_indices\nend_header\n" + six +
                   "7 0 1 2 -1 3 4 5\n"),
              40.0,
              0.02)
      << "two strips of a triangle";
  const std::string square = "0 0 0\n2 0 0\n2 2 0\n0 2 0\n";
  EXPECT_NEAR(area(kPlyHead + "element vertex 4\ncomment amid\n" + kXyz +
                   "element face 1\nproperty list uchar int vertex_index\nend_header\n" + square +
                   "4 0 1 2 3\n"),
              4.0,
              0.02)
      << "a comment amid an element";
  EXPECT_NEAR(area(kPlyHead + "element face 1\nproperty uchar flags\n" +
                   "property list uchar int vertex_indices\n" +
                   "property list uchar float texcoord\nelement vertex 4\n" + kXyz +
                   "end_header\n7 4 0 1 2 3 2 0.5 0.5\n" + square),
              4.0,
              0.02)
      << "faces first, beside other properties";
  // an L: its bounding square without a quarter
  EXPECT_NEAR(area(kPlyHead + "element vertex 6\n" + kXyz +
                   "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
                   "2 2 0\n1 2 0\n1 1 0\n0 1 0\n0 0 0\n2 0 0\n6 0 1 2 3 4 5\n"),
              3.0,
              0.02)
      << "a reentrant face";
  expect_contains(error_of([&] {
                    area(kPlyHead + "element vertex 4\n" + kXyz +
                         "element face 1\nproperty list uchar int vertex_indices\nend_header\n" +
                         square + "4 0 1 2 4\n");
                  }),
                  "a.ply:14: a face names vertex 4, the file has 4");
}

TEST(Mesh, BinaryPlyWhoseDataBeginsWithALineFeed) {
  const TemporaryFolder folder;
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty uchar mark\n" + kXyz +
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const float corners[3][3] = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}};
  for (const auto& corner : corners) {
    bytes += '\x0a';
    for (const float c : corner) put_raw(bytes, c);
  }
  bytes += '\x03';
  for (const std::int32_t i : {0, 1, 2}) put_raw(bytes, i);
  EXPECT_NEAR(area_of(folder, "a.ply", bytes), 8.0, 0.02);
}

TEST(Mesh, ObjOfAllShapes) {
  const TemporaryFolder folder;
  const auto area = [&](const std::string& bytes) { return area_of(folder, "a.obj", bytes); };
  const std::string square = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\n";
  EXPECT_NEAR(area(square + "f 1/1/1 2/2/1 3/3/1 4/4/1\n"), 4.0, 0.02) << "absent vt and vn";
  EXPECT_NEAR(area(square + "f 1//7 2//7 3//7\n"), 2.0, 0.02);
  EXPECT_NEAR(area(square + "f -4 -3 -2 -1\nv 9 9 9\n"), 4.0, 0.02) << "counted from the end";
  EXPECT_NEAR(area("f 1 2 3 4\n" + square), 4.0, 0.02) << "faces first";
  EXPECT_NEAR(area(square + "f 1 2 \\\n3 4\n"), 4.0, 0.02) << "a line that goes on";
  EXPECT_NEAR(area(square + "l 1 2\np 3\ng a b\nusemtl x\nf 1 2 3 # last\n"), 2.0, 0.02);
  expect_contains(error_of([&] { area(square + "f 1 2 5\n"); }),
                  "a.obj:5: a face names vertex '5', the file has 4");
  expect_contains(error_of([&] { area(square + "f 0 1 2\n"); }), "a.obj:5:");
  expect_contains(error_of([&] { area("v 0 0\nf 1 1 1\n"); }), "a.obj:1: a vertex wants x y z");
}

TEST(Mesh, PlacesFarFromZeroKeepTheirMillimetres) {
  const TemporaryFolder folder;
  write_file(folder / "a.obj",
             "v 500000 5000000 300\nv 500010 5000000 300\nv 500010 5000008.003 300\n"
             "v 500000 5000008.003 300\nf 1 2 3 4\n");
  MeshSampling sampling;
  sampling.points_per_square_metre = 100.0;
  const auto reader = open_mesh(folder / "a.obj", ".obj", sampling, kShort);
  std::vector<CloudPoint> batch;
  double north = 0.0;
  while (reader->read(batch)) {
    for (const CloudPoint& point : batch) north = std::max(north, point.position.y());
  }
  EXPECT_NEAR(north, 5000008.003, 0.01);
  std::string ply = "ply\nformat binary_little_endian 1.0\nelement vertex 3\n" + kXyz +
                    "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  for (const float c : {5e5f, 5e6f, 0.f, 500010.f, 5e6f, 0.f, 500010.f, 5000008.f, 0.f}) {
    put_raw(ply, c);
  }
  ply += '\x03';
  for (const std::int32_t i : {0, 1, 2}) put_raw(ply, i);
  write_file(folder / "a.ply", ply);
  expect_contains(error_of([&] { points_in(folder / "a.ply"); }), "single precision");
}

TEST(Mesh, HeadersSayWhichAxisIsUp) {
  if (!reads_meshes()) GTEST_SKIP() << "built without assimp";
  const TemporaryFolder folder;
  const auto up = [&](const std::string& name, const std::string& bytes) {
    write_file(folder / name, bytes);
    return open_mesh(folder / name, name.substr(name.rfind('.')), {}, kShort)->up_axis();
  };
  EXPECT_EQ(up("a.glb", glb()), 'y') << "glTF 2.0, 3.4";
  EXPECT_EQ(up("a.obj", obj()), std::nullopt);
  const std::string text = dae();
  const std::size_t at = text.find("Z_UP");
  ASSERT_NE(at, std::string::npos);
  for (const auto& [word, axis] : {std::pair{"Y_UP", 'y'}, {"Z_UP", 'z'}, {"X_UP", 'x'}}) {
    std::string with = text;
    with.replace(at, 4, word);
    EXPECT_EQ(up("a.dae", with), axis);
  }
}

TEST(Triangulated, CoversPolygonsOfAnyShapeOnce) {
  // a comb with four teeth
  std::vector<Vector3d> comb = {{0, 0, 1}, {8, 0, 1}};
  for (int tooth = 7; tooth >= 0; --tooth) {
    comb.emplace_back(tooth + 1, tooth % 2 == 0 ? 3 : 1, 1);
    comb.emplace_back(tooth, tooth % 2 == 0 ? 3 : 1, 1);
  }
  double sum = 0.0;
  for (const auto& [a, b, c] : triangulated(comb)) {
    const Vector3d twice = (comb[b] - comb[a]).cross(comb[c] - comb[a]);
    EXPECT_GE(twice.z(), 0.0) << "as the polygon turns";
    sum += 0.5 * twice.z();
  }
  EXPECT_NEAR(sum, 4 * 3.0 + 4 * 1.0, 1e-12);
  EXPECT_TRUE(triangulated(std::span(comb).first(2)).empty());
  const std::vector<Vector3d> nowhere(9, Vector3d::Zero());
  EXPECT_EQ(triangulated(nowhere).size(), 7u) << "it ends";
}

}  // namespace
}  // namespace pointflight
