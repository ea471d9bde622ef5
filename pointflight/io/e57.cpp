#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/math.hpp"
#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/formats.hpp"
#include "pointflight/io/internal/e57_records.hpp"

// ASTM E2807 (E57): scans of points in the scanner's frame, each with its pose.
namespace pointflight {
namespace {

/// What is read of a point. The state is 0 where the point is one.
enum E57Column : std::size_t {
  kX,
  kY,
  kZ,
  kIntensity,
  kRed,
  kGreen,
  kBlue,
  kState,
  kColumns,
};
constexpr std::array<const char*, kColumns> kE57Cartesian = {"cartesianX",
                                                             "cartesianY",
                                                             "cartesianZ",
                                                             "intensity",
                                                             "colorRed",
                                                             "colorGreen",
                                                             "colorBlue",
                                                             "cartesianInvalidState"};
constexpr std::array<const char*, kColumns> kE57Spherical = {"sphericalRange",
                                                             "sphericalAzimuth",
                                                             "sphericalElevation",
                                                             "intensity",
                                                             "colorRed",
                                                             "colorGreen",
                                                             "colorBlue",
                                                             "sphericalInvalidState"};

/// Numbers of the fields that are read of a scan.
struct E57Layout {
  bool spherical = false;
  std::vector<std::size_t> wanted;                      // fields, those that there are
  std::array<std::optional<std::size_t>, kColumns> at;  // of `wanted`
};

std::optional<std::size_t> field_named(const E57Scan& scan, std::string_view name) {
  for (std::size_t i = 0; i < scan.fields.size(); ++i) {
    if (scan.fields[i].name == name) return i;
  }
  return std::nullopt;
}

E57Layout layout_of(const E57Scan& scan, const std::string& path) {
  E57Layout layout;
  layout.spherical = !field_named(scan, kE57Cartesian[kX]);
  const auto& names = layout.spherical ? kE57Spherical : kE57Cartesian;
  for (std::size_t column = 0; column < kColumns; ++column) {
    const auto field = field_named(scan, names[column]);
    if (!field && column <= kZ) {
      throw InputError(fmt::format(
          "{}: the scan '{}' has points without {}; cartesianX, Y, Z or sphericalRange, Azimuth, "
          "Elevation are wanted",
          path,
          excerpt(scan.name),
          names[column]));
    }
    if (!field) continue;
    layout.at[column] = layout.wanted.size();
    layout.wanted.push_back(*field);
  }
  return layout;
}

class E57Reader : public CloudReader {
 public:
  explicit E57Reader(MappedFile file) : pages_(std::move(file)), scans_(e57_scans(pages_)) {
    for (const E57Scan& scan : scans_) {
      const E57Layout& layout = layouts_.emplace_back(layout_of(scan, pages_.path()));
      has_intensity_ = has_intensity_ || layout.at[kIntensity];
      has_color_ = has_color_ || layout.at[kBlue];
      points_ += static_cast<double>(scan.points);
    }
  }

  bool read(std::vector<CloudPoint>& batch) override {
    batch.clear();
    while (batch.empty() && scan_ < scans_.size()) {
      if (!records_) records_.emplace(pages_, scans_[scan_], layouts_[scan_].wanted);
      if (records_->next()) {
        take_points(batch);
        pages_.release_before(records_->offset());
      } else {
        records_.reset();
        ++scan_;
      }
    }
    return !batch.empty();
  }

  [[nodiscard]] bool has_intensity() const override { return has_intensity_; }
  [[nodiscard]] bool has_color() const override { return has_color_; }
  [[nodiscard]] std::optional<FileUnit> unit() const override { return FileUnit{"metre", 1.0}; }
  [[nodiscard]] FileColumns columns() const override {
    FileColumns columns;
    if (has_intensity_) columns.intensity = "intensity";
    columns.left_out = left_out();
    columns.notes.push_back(fmt::format("{} scan{}, each by its pose", scans_.size(), plural()));
    if (invalid_ > 0) {
      columns.notes.push_back(fmt::format("{} beams without a point are left out", invalid_));
    }
    return columns;
  }
  [[nodiscard]] double share_read() const override { return points_ > 0.0 ? read_ / points_ : 1.0; }

 private:
  [[nodiscard]] const char* plural() const { return scans_.size() == 1 ? "" : "s"; }

  [[nodiscard]] std::vector<std::string> left_out() const {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < scans_.size(); ++i) {
      for (std::size_t field = 0; field < scans_[i].fields.size(); ++field) {
        const auto& wanted = layouts_[i].wanted;
        const std::string& name = scans_[i].fields[field].name;
        if (std::find(wanted.begin(), wanted.end(), field) != wanted.end()) continue;
        if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
      }
    }
    return names;
  }

  void take_points(std::vector<CloudPoint>& batch) {
    const E57Layout& layout = layouts_[scan_];
    const E57Scan& scan = scans_[scan_];
    for (std::size_t i = 0; i < records_->size(); ++i) {
      const auto value = [&](E57Column column, double otherwise = 0.0) {
        const auto at = layout.at[column];
        return at ? records_->values(*at)[i] : otherwise;
      };
      if (value(kState) != 0.0) {
        ++invalid_;
        continue;
      }
      Vector3d p(value(kX), value(kY), value(kZ));
      if (layout.spherical) p = from_spherical(p);
      CloudPoint& point = batch.emplace_back();
      point.position = scan.T_world_scan * p;
      point.intensity = static_cast<float>(value(kIntensity));
      for (std::size_t c = 0; c < 3 && layout.at[kRed + c]; ++c) {
        const double color = value(static_cast<E57Column>(kRed + c)) - scan.color_offset;
        const double of_255 = std::clamp(color * scan.color_scale, 0.0, 255.0);
        point.color[c] = static_cast<std::uint8_t>(std::isnan(of_255) ? 0 : std::lround(of_255));
      }
    }
    read_ += static_cast<double>(records_->size());
  }

  /// Of range, azimuth from x to y, elevation above the x-y plane.
  static Vector3d from_spherical(const Vector3d& p) {
    const auto azimuth = math::sincos(p.y());
    const auto elevation = math::sincos(p.z());
    return p.x() *
           Vector3d(elevation.cos * azimuth.cos, elevation.cos * azimuth.sin, elevation.sin);
  }

  E57Pages pages_;
  std::vector<E57Scan> scans_;
  std::vector<E57Layout> layouts_;
  std::optional<E57Records> records_;
  std::size_t scan_ = 0;
  double points_ = 0.0;
  double read_ = 0.0;
  std::uint64_t invalid_ = 0;
  bool has_intensity_ = false;
  bool has_color_ = false;
};

}  // namespace

std::unique_ptr<CloudReader> open_e57(MappedFile file) {
  return std::make_unique<E57Reader>(std::move(file));
}

}  // namespace pointflight
