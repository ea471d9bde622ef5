#include "pointflight/io/cloud_writer.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <utility>

#include "pointflight/core/argument.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/core/version.hpp"

namespace pointflight {
namespace {

constexpr double kFloatIsExactEnough = 4096.0;  // a float's step is below 0.5 mm up to here
constexpr double kFloatIsTooCoarse = 65536.0;   // 8 mm from here on

template <class T>
void put(std::vector<std::byte>& bytes, const T& value) {
  const auto* from = reinterpret_cast<const std::byte*>(&value);
  bytes.insert(bytes.end(), from, from + sizeof(T));
}

/// One column of PCD and PLY.
struct Column {
  std::string pcd;
  std::string ply;
  char type;  ///< As in PCD: 'F', or 'U'.
  int size;
};

/// PCD and PLY: a text header with the number of points, then rows.
class RowWriter : public CloudWriter {
 public:
  RowWriter(OutputFile file, const CloudColumns& columns, bool is_pcd)
      : CloudWriter(std::move(file)), columns_(columns), is_pcd_(is_pcd) {}

  void commit() override {
    if (!begun_) {
      begun_ = true;
      begin({});
    }
    // the same number of bytes as at first
    const std::string text = header(count_);
    file_.write_at(0, std::as_bytes(std::span<const char>(text.data(), text.size())));
    file_.commit();
  }

 protected:
  void begin(std::span<const CloudRow> rows) override {
    for (const CloudRow& row : rows) {
      const Vector3d& p = row.point.position;  // NaN: a beam of an organised cloud
      wide_ = wide_ || (p.allFinite() && p.cwiseAbs().maxCoeff() >= kFloatIsExactEnough);
    }
    file_.write(header(std::numeric_limits<std::uint64_t>::max()));
  }

  void append(const CloudRow& row, std::vector<std::byte>& bytes) override {
    const Vector3d& p = row.point.position;
    if (!wide_ && p.cwiseAbs().maxCoeff() > kFloatIsTooCoarse) {
      throw InputError(
          fmt::format("{}: a point at ({:.0f}, {:.0f}, {:.0f}) is too far from the first ones for "
                      "single precision; crop it away first",
                      file_.path(),
                      p.x(),
                      p.y(),
                      p.z()));
    }
    for (int axis = 0; axis < 3; ++axis) {
      if (wide_) {
        put(bytes, p[axis]);
      } else {
        put(bytes, static_cast<float>(p[axis]));
      }
    }
    if (columns_.intensity) put(bytes, row.point.intensity);
    if (columns_.color) {
      const auto& c = row.point.color;
      if (is_pcd_) {
        put(bytes, std::uint32_t{c[0]} << 16 | std::uint32_t{c[1]} << 8 | std::uint32_t{c[2]});
      } else {
        put(bytes, c);
      }
    }
    if (columns_.normal) put_vector(bytes, row.normal);
    if (columns_.ellipsoid) {
      put_vector(bytes, row.spread);
      put(bytes, row.axes.w());
      put_vector(bytes, row.axes.vec());
      put(bytes, row.surfel);
    }
    put_raw(bytes, row.raw);
  }

 private:
  /// PLY knows no whole numbers of 64 bits.
  [[nodiscard]] bool is_widened(const RawColumn& column) const {
    return !is_pcd_ && column.size == 8 && column.type != 'F';
  }

  void put_raw(std::vector<std::byte>& bytes, std::span<const std::byte> raw) {
    for (const RawColumn& column : columns_.raw) {
      require_argument(raw.size() >= column.size, "CloudWriter: a row lacks raw columns");
      const auto value = raw.first(column.size);
      raw = raw.subspan(column.size);
      if (!is_widened(column)) {
        bytes.insert(bytes.end(), value.begin(), value.end());
        continue;
      }
      const auto number = [&](auto whole) {
        std::memcpy(&whole, value.data(), sizeof whole);
        const auto wide = static_cast<double>(whole);
        is_rounded_ = is_rounded_ || std::abs(wide) > 9007199254740992.0;
        return wide;
      };
      put(bytes, column.type == 'I' ? number(std::int64_t{}) : number(std::uint64_t{}));
    }
  }

  static void put_vector(std::vector<std::byte>& bytes, const Vector3f& v) {
    for (int axis = 0; axis < 3; ++axis) put(bytes, v[axis]);
  }

  [[nodiscard]] std::vector<Column> columns() const {
    const int size = wide_ ? 8 : 4;
    std::vector<Column> all = {{"x", "x", 'F', size}, {"y", "y", 'F', size}, {"z", "z", 'F', size}};
    const auto add = [&](std::initializer_list<Column> more) {
      all.insert(all.end(), more.begin(), more.end());
    };
    if (columns_.intensity) add({{"intensity", "intensity", 'F', 4}});
    if (columns_.color && is_pcd_) add({{"rgb", "", 'U', 4}});
    if (columns_.color && !is_pcd_) {
      add({{"", "red", 'U', 1}, {"", "green", 'U', 1}, {"", "blue", 'U', 1}});
    }
    if (columns_.normal) {
      add({{"normal_x", "nx", 'F', 4}, {"normal_y", "ny", 'F', 4}, {"normal_z", "nz", 'F', 4}});
    }
    if (columns_.ellipsoid) {
      add({{"s0", "s0", 'F', 4}, {"s1", "s1", 'F', 4}, {"s2", "s2", 'F', 4}});
      add({{"qw", "qw", 'F', 4}, {"qx", "qx", 'F', 4}, {"qy", "qy", 'F', 4}, {"qz", "qz", 'F', 4}});
      add({{"surfel", "surfel", 'U', 4}});
    }
    for (const RawColumn& raw : columns_.raw) {
      const char type = is_widened(raw) ? 'F' : raw.type;
      add({{raw.name, raw.name, type, static_cast<int>(raw.size)}});
    }
    return all;
  }

  /// As long for each number of points: a comment takes up what the digits leave.
  [[nodiscard]] std::string header(std::uint64_t points) const {
    const auto text = [&](const std::string& digits, const std::string& filler) {
      return is_pcd_ ? pcd_header(digits, filler) : ply_header(digits, filler);
    };
    const std::string digits = std::to_string(points);
    const std::size_t shortest = text(digits, "").size();
    const std::size_t longest = text(std::string(20, '9'), "").size();
    return text(digits, std::string(longest - shortest, '.'));
  }

  [[nodiscard]] std::string pcd_header(const std::string& points, const std::string& filler) const {
    std::string names;
    std::string sizes;
    std::string types;
    std::string counts;
    for (const Column& column : columns()) {
      names += fmt::format(" {}", column.pcd);
      sizes += fmt::format(" {}", column.size);
      types += fmt::format(" {}", column.type);
      counts += " 1";
    }
    return fmt::format(
        "# .PCD v0.7 - Point Cloud Data file format\n# pointflight {}{}\nVERSION 0.7\nFIELDS{}\n"
        "SIZE{}\nTYPE{}\nCOUNT{}\nWIDTH {}\nHEIGHT {}\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {}\n"
        "DATA binary\n",
        kVersion,
        filler,
        names,
        sizes,
        types,
        counts,
        columns_.shape ? std::to_string(columns_.shape->width) : points,
        columns_.shape ? columns_.shape->height : 1,
        points);
  }

  [[nodiscard]] std::string loss() const override {
    return is_rounded_ ? "PLY has no whole numbers of 64 bits: they are written as doubles, rounded"
                       : "";
  }

  static std::string ply_type(const Column& column) {
    if (column.type == 'F') return column.size == 8 ? "double" : "float";
    const std::string whole = column.size == 4 ? "int" : column.size == 2 ? "short" : "char";
    return column.type == 'U' ? "u" + whole : whole;
  }

  [[nodiscard]] std::string ply_header(const std::string& points, const std::string& filler) const {
    std::string properties;
    for (const Column& column : columns()) {
      properties += fmt::format("property {} {}\n", ply_type(column), column.ply);
    }
    return fmt::format(
        "ply\nformat binary_little_endian 1.0\ncomment pointflight {}{}\nelement vertex {}\n{}"
        "end_header\n",
        kVersion,
        filler,
        points,
        properties);
  }

  CloudColumns columns_;
  bool is_pcd_;
  bool wide_ = false;
  bool is_rounded_ = false;
};

/// LAS 1.2, point format 0, or 2 with colours (ASPRS LAS Specification 1.2).
class LasWriter : public CloudWriter {
 public:
  LasWriter(OutputFile file, const CloudColumns& columns)
      : CloudWriter(std::move(file)), columns_(columns) {
    if (!columns.normal && !columns.ellipsoid) return;
    throw InputError(fmt::format(
        "{}: LAS has no place for normals or ellipsoids; write .ply or .pcd, or points only",
        file_.path()));
  }

  void commit() override {
    if (!begun_) {
      begun_ = true;
      begin({});
    }
    file_.write_at(0, header());
    file_.commit();
  }

  [[nodiscard]] std::string loss() const override {
    std::vector<std::string> lost;
    if (columns_.intensity && !intensity_.fits()) {
      lost.push_back(
          fmt::format("LAS holds intensities as whole numbers from 0 to 65535; these "
                      "went from {:.4g} to {:.4g}",
                      intensity_.min,
                      intensity_.max));
    }
    if (!columns_.raw.empty()) {
      std::vector<std::string> names;
      for (const RawColumn& column : columns_.raw) names.push_back(column.name);
      lost.push_back(
          fmt::format("LAS has no place for {}; .pcd and .ply keep them", fmt::join(names, ", ")));
    }
    return fmt::format("{}", fmt::join(lost, "; "));
  }

 protected:
  void begin(std::span<const CloudRow> rows) override {
    if (!rows.empty()) offset_ = rows.front().point.position.array().round();
    file_.write(header());
  }

  void append(const CloudRow& row, std::vector<std::byte>& bytes) override {
    if (count_ >= std::numeric_limits<std::uint32_t>::max()) {
      throw InputError(fmt::format(
          "{}: LAS 1.2 holds 4.29 G points at most; crop, thin or write .ply", file_.path()));
    }
    const Vector3d& p = row.point.position;
    for (int axis = 0; axis < 3; ++axis) {
      const double steps = std::round((p[axis] - offset_[axis]) / kStep);
      if (!(std::abs(steps) <= static_cast<double>(std::numeric_limits<std::int32_t>::max()))) {
        throw InputError(
            fmt::format("{}: a point lies more than 214 km from the first one, too far for LAS in "
                        "steps of 0.1 mm; crop it away first",
                        file_.path()));
      }
      put(bytes, static_cast<std::int32_t>(steps));
    }
    const float intensity = columns_.intensity ? row.point.intensity : 0.0f;
    intensity_.add(intensity);
    put(bytes, static_cast<std::uint16_t>(std::clamp(std::round(intensity), 0.0f, 65535.0f)));
    put(bytes, std::uint8_t{0x09});  // the first of one return
    put(bytes, std::array<std::uint8_t, 5>{});
    if (columns_.color) {
      for (const std::uint8_t c : row.point.color) put(bytes, static_cast<std::uint16_t>(c * 257u));
    }
    // as a reader will have it
    bounds_.add(offset_ + kStep * ((p - offset_) / kStep).array().round().matrix());
  }

 private:
  static constexpr double kStep = 1e-4;  // m

  struct Intensities {
    float min = std::numeric_limits<float>::infinity();
    float max = -std::numeric_limits<float>::infinity();
    bool whole = true;
    void add(float value) {
      min = std::min(min, value);
      max = std::max(max, value);
      whole = whole && value == std::round(value);
    }
    [[nodiscard]] bool fits() const {
      return !(min <= max) || (min >= 0.0f && max <= 65535.0f && (whole || max > 100.0f));
    }
  };

  [[nodiscard]] std::vector<std::byte> header() const {
    std::vector<std::byte> bytes;
    const auto put_text = [&](std::string text, std::size_t size) {
      text.resize(size);
      for (const char c : text) bytes.push_back(static_cast<std::byte>(c));
    };
    put_text("LASF", 4);
    put_text("", 20);  // source, encoding, project
    put(bytes, std::array<std::uint8_t, 2>{1, 2});
    put_text("pointflight", 32);
    put_text(fmt::format("pointflight {}", kVersion), 32);
    put(bytes, std::array<std::uint16_t, 2>{});  // no date: the same bytes each day
    put(bytes, std::uint16_t{227});
    put(bytes, std::uint32_t{227});
    put(bytes, std::uint32_t{0});
    put(bytes, static_cast<std::uint8_t>(columns_.color ? 2 : 0));
    put(bytes, static_cast<std::uint16_t>(columns_.color ? 26 : 20));
    const auto points = static_cast<std::uint32_t>(count_);
    put(bytes, points);
    put(bytes, std::array<std::uint32_t, 5>{points});
    for (int axis = 0; axis < 3; ++axis) put(bytes, kStep);
    for (int axis = 0; axis < 3; ++axis) put(bytes, offset_[axis]);
    for (int axis = 0; axis < 3; ++axis) {
      put(bytes, count_ == 0 ? 0.0 : bounds_.max[axis]);
      put(bytes, count_ == 0 ? 0.0 : bounds_.min[axis]);
    }
    return bytes;
  }

  CloudColumns columns_;
  Vector3d offset_ = Vector3d::Zero();
  Aabb bounds_;
  Intensities intensity_;
};

enum class Kind { kPcd, kPly, kLas };

Kind kind_of(const std::string& path) {
  const std::string extension = std::filesystem::path(path).extension().string();
  if (extension == ".pcd") return Kind::kPcd;
  if (extension == ".ply") return Kind::kPly;
  if (extension == ".las") return Kind::kLas;
  throw InputError(
      fmt::format("{}: clouds are written as .pcd, .ply or .las; give one of these names", path));
}

}  // namespace

void CloudWriter::write(std::span<const CloudPoint> points, std::span<const std::byte> raw) {
  rows_.resize(points.size());
  const std::size_t size = points.empty() ? 0 : raw.size() / points.size();
  for (std::size_t i = 0; i < points.size(); ++i) {
    rows_[i].point = points[i];
    rows_[i].raw = raw.subspan(i * size, size);
  }
  write(std::span<const CloudRow>(rows_));
}

void CloudWriter::write(std::span<const CloudRow> rows) {
  if (rows.empty()) return;
  if (!std::exchange(begun_, true)) begin(rows);
  bytes_.clear();
  for (const CloudRow& row : rows) {
    append(row, bytes_);
    ++count_;
  }
  file_.write(bytes_);
}

std::unique_ptr<CloudWriter> write_cloud(OutputFile file, const CloudColumns& columns) {
  const Kind kind = kind_of(file.path());
  if (kind == Kind::kLas) return std::make_unique<LasWriter>(std::move(file), columns);
  return std::make_unique<RowWriter>(std::move(file), columns, kind == Kind::kPcd);
}

void require_writable_cloud(const std::string& path) {
  kind_of(path);
}

}  // namespace pointflight
