#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "pointflight/core/input_error.hpp"
#include "pointflight/io/cloud_reader.hpp"
#include "pointflight/io/internal/e57_pages.hpp"
#include "tests/io/clouds.hpp"
#include "tests/io/e57_files.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::double_bits;
using testing::E57TestField;
using testing::E57TestScan;
using testing::error_of;
using testing::expect_contains;
using testing::float_bits;
using testing::read_all;
using testing::TemporaryFolder;
using testing::write_file;

E57TestScan three_points() {
  E57TestScan scan;
  scan.fields = {{"cartesianX type=\"Float\" precision=\"single\"", 32, {}},
                 {"cartesianY type=\"Float\"", 64, {}},
                 {"cartesianZ type=\"Float\" precision=\"double\"", 64, {}},
                 {"intensity type=\"Integer\" minimum=\"0\" maximum=\"30\"", 5, {10, 20, 30}}};
  for (const CloudPoint& point : testing::kPoints) {
    scan.fields[0].stored.push_back(float_bits(static_cast<float>(point.position.x())));
    scan.fields[1].stored.push_back(double_bits(point.position.y()));
    scan.fields[2].stored.push_back(double_bits(point.position.z()));
  }
  return scan;
}

// of a file that is written and thrown away
std::vector<CloudPoint> points_of(const std::vector<E57TestScan>& scans) {
  const TemporaryFolder folder;
  write_file(folder / "a.e57", testing::e57_file(scans));
  return read_all(folder / "a.e57");
}

TEST(E57, ReadsFloatsOfBothSizesAndWholeNumbers) {
  testing::expect_points(points_of({three_points()}), true);
}

// RFC 3720, B.4: 32 bytes of zeros, of ones, 0 to 31
TEST(E57, ChecksumsAreThoseOfTheStandard) {
  std::vector<std::byte> bytes(32, std::byte{0});
  EXPECT_EQ(crc32c(bytes), 0x8a9136aau);
  bytes.assign(32, std::byte{0xff});
  EXPECT_EQ(crc32c(bytes), 0x62a8ab43u);
  for (unsigned i = 0; i < 32; ++i) bytes[i] = static_cast<std::byte>(i);
  EXPECT_EQ(crc32c(bytes), 0x46dd794eu);
  EXPECT_EQ(crc32c(std::span(bytes).first(13)),
            testing::slow_crc32c(std::string(reinterpret_cast<const char*>(bytes.data()), 13)));
}

TEST(E57, PacksWholeNumbersToAnyWidth) {
  for (const unsigned bits : {1u, 3u, 8u, 13u, 31u, 33u, 47u, 57u, 61u}) {
    E57TestScan scan;
    const auto most = static_cast<std::int64_t>((std::uint64_t{1} << bits) - 1);
    const std::int64_t least = bits < 60 ? -1000 : -5;
    const std::string range = " minimum=\"" + std::to_string(least) + "\" maximum=\"" +
                              std::to_string(most + least) + "\"";
    scan.fields = {
        {"cartesianX type=\"ScaledInteger\" scale=\"0.001\" offset=\"7\"" + range, bits, {}},
        {"cartesianY type=\"Integer\"" + range, bits, {}},
        {"cartesianZ type=\"Integer\" minimum=\"4\" maximum=\"4\"", 0, {}}};
    std::uint64_t value = 1;
    for (int i = 0; i < 300; ++i) {
      value = value * 6364136223846793005u + 1442695040888963407u;
      scan.fields[0].stored.push_back(value >> (64 - bits));
      scan.fields[1].stored.push_back((~value) >> (64 - bits));
    }
    const auto points = points_of({scan});
    ASSERT_EQ(points.size(), 300u) << bits;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto whole = [&](std::size_t field) {
        return static_cast<double>(static_cast<std::int64_t>(scan.fields[field].stored[i]) + least);
      };
      EXPECT_EQ(points[i].position.x(), whole(0) * 0.001 + 7.0) << bits;
      EXPECT_EQ(points[i].position.y(), whole(1)) << bits;
      EXPECT_EQ(points[i].position.z(), 4.0);
    }
  }
}

TEST(E57, EachScanIsTurnedAndShiftedByItsPose) {
  E57TestScan turned = three_points();
  // 90 degrees about z
  turned.xml =
      "<name type=\"String\"><![CDATA[second]]></name><pose type=\"Structure\">"
      "<rotation type=\"Structure\"><w type=\"Float\">7.0710678118654757e-01</w>"
      "<x type=\"Float\"/><y type=\"Float\">0</y><z type=\"Float\">7.0710678118654757e-01</z>"
      "</rotation><translation type=\"Structure\"><x type=\"Float\">100</x>"
      "<y type=\"Float\">-50.5</y><z type=\"Float\">3</z></translation></pose>";
  const auto points = points_of({three_points(), turned});
  ASSERT_EQ(points.size(), 6u);
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector3d p = testing::kPoints[i].position;
    EXPECT_EQ(points[i].position, p);
    EXPECT_LT((points[3 + i].position - Vector3d(100.0 - p.y(), p.x() - 50.5, p.z() + 3.0)).norm(),
              1e-12);
  }
}

TEST(E57, SphericalPointsAndThoseThatAreNone) {
  E57TestScan scan;
  scan.fields = {
      {"sphericalRange type=\"Float\"", 64, {double_bits(2.0), double_bits(3.0), double_bits(4.0)}},
      {"sphericalAzimuth type=\"Float\"",
       64,
       {double_bits(std::numbers::pi / 2), double_bits(1.0), double_bits(0.5)}},
      {"sphericalElevation type=\"Float\"",
       64,
       {double_bits(std::numbers::pi / 6), double_bits(0.0), double_bits(-0.5)}},
      {"sphericalInvalidState type=\"Integer\" minimum=\"0\" maximum=\"2\"", 2, {0, 2, 0}},
      {"rowIndex type=\"Integer\" minimum=\"0\" maximum=\"9\"", 4, {1, 2, 3}}};
  const TemporaryFolder folder;
  write_file(folder / "a.e57", testing::e57_file({scan}));
  const auto points = read_all(folder / "a.e57");
  ASSERT_EQ(points.size(), 2u);
  EXPECT_LT((points[0].position - Vector3d(0.0, std::sqrt(3.0), 1.0)).norm(), 1e-12);
  EXPECT_NEAR(points[1].position.z(), -4.0 * std::sin(0.5), 1e-12);

  const auto reader = open_cloud(folder / "a.e57");
  std::vector<CloudPoint> batch;
  while (reader->read(batch)) {
  }
  const FileColumns columns = reader->columns();
  EXPECT_EQ(columns.left_out, std::vector<std::string>{"rowIndex"});
  ASSERT_EQ(columns.notes.size(), 2u);
  EXPECT_EQ(columns.notes[1], "1 beams without a point are left out");
  EXPECT_FALSE(reader->has_intensity());
}

TEST(E57, ColoursOfAnyScaleBecomeBytes) {
  E57TestScan bytes = three_points();
  E57TestScan words = three_points();
  for (const char* name : {"colorRed", "colorGreen", "colorBlue"}) {
    bytes.fields.push_back(
        {name + std::string(" type=\"Integer\" minimum=\"0\" maximum=\"255\""), 8, {0, 7, 255}});
    words.fields.push_back({name + std::string(" type=\"Float\" precision=\"single\""),
                            32,
                            {float_bits(0.0f), float_bits(0.5f), float_bits(1.0f)}});
  }
  words.xml =
      "<colorLimits type=\"Structure\"><colorRedMinimum type=\"Float\"/>"
      "<colorRedMaximum type=\"Float\">1</colorRedMaximum></colorLimits>";
  const auto points = points_of({bytes, words});
  ASSERT_EQ(points.size(), 6u);
  const auto grey = [](int level) {
    const auto byte = static_cast<std::uint8_t>(level);
    return std::array{byte, byte, byte};
  };
  EXPECT_EQ(points[1].color, grey(7));
  EXPECT_EQ(points[2].color, grey(255));
  EXPECT_EQ(points[4].color, grey(128));
  EXPECT_EQ(points[5].color, grey(255));
}

TEST(E57, DamageIsSaidInOneLine) {
  const TemporaryFolder folder;
  const std::string sound = testing::e57_file({three_points()});
  const auto fault_of = [&](const std::string& bytes) {
    write_file(folder / "a.e57", bytes);
    const std::string fault = error_of([&] { read_all(folder / "a.e57"); });
    EXPECT_EQ(fault.find('\n'), std::string::npos) << fault;
    return fault;
  };
  expect_contains(fault_of("ASTM-E57"), "does not start with an E57 header");
  expect_contains(fault_of(sound.substr(0, 1500)), "it is cut off");
  std::string flipped = sound;
  flipped[300] = static_cast<char>(flipped[300] ^ 1);
  expect_contains(fault_of(flipped), "byte 0: the checksum of this page is wrong");

  const auto with = [&](const std::string& from, const std::string& to) {
    E57TestScan scan = three_points();
    auto& element = scan.fields[2].element;
    element.replace(element.find(from), from.size(), to);
    return fault_of(testing::e57_file({scan}));
  };
  expect_contains(with("cartesianZ", "height"), "points without cartesianZ");
  expect_contains(with("Float", "String"), "has the type 'String'");
  expect_contains(with("type=\"Float\"", "type=\"Integer\" minimum=\"9\" maximum=\"3\""),
                  "the maximum is below the minimum");
  expect_contains(with("type=\"Float\"", "type=\"Integer\" minimum=\"nine\""), "no whole number");

  E57TestScan short_one = three_points();
  short_one.fields[0].stored.resize(5);  // of the other fields there are three
  expect_contains(fault_of(testing::e57_file({short_one})), "of its 5 points are missing");

  E57TestScan unnamed = three_points();
  unnamed.xml = "<oops>";
  expect_contains(fault_of(testing::e57_file({unnamed})), "is no XML");
  expect_contains(fault_of(testing::e57_file({})), "lists no scan");
}

TEST(E57, StandardInputIsToldByItsFirstBytes) {
  const TemporaryFolder folder;
  write_file(folder / "a.e57", testing::e57_file({three_points()}));
  std::FILE* file = std::fopen((folder / "a.e57").c_str(), "rb");
  ASSERT_NE(file, nullptr);
  const CloudSource source = CloudSource::from_stream(fileno(file), "", "", {});
  std::fclose(file);
  EXPECT_EQ(source.open()->has_intensity(), true);
}

}  // namespace
}  // namespace pointflight
