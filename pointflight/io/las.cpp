#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/file_unit.hpp"
#include "pointflight/io/formats.hpp"

// ASPRS LAS Specification 1.4 R15, tables 3 (header) and 6 ff. (point formats).
namespace pointflight {
namespace {

constexpr std::size_t kHeaderSize = 227;    // 1.0 - 1.2
constexpr std::size_t kHeaderSize14 = 375;  // 1.4: 64-bit counts at byte 247
constexpr std::size_t kMinPointSize[] = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
constexpr std::size_t kColorAt[] = {0, 0, 20, 28, 0, 28, 0, 30, 30, 0, 30};  // 0: no colours

class LasReader : public CloudReader {
 public:
  explicit LasReader(MappedFile file) : file_(std::move(file)) {
    const auto bytes = file_.bytes();
    if (bytes.size() < kHeaderSize || as_text(bytes.subspan(0, 4)) != "LASF") {
      fail(0, "does not start with a LAS header ('LASF', 227 bytes)");
    }
    const auto minor = std::to_integer<unsigned>(bytes[25]);
    if (std::to_integer<unsigned>(bytes[24]) != 1 || minor > 4) {
      fail(24,
           fmt::format("LAS version {}.{}; 1.0 to 1.4 are read",
                       std::to_integer<unsigned>(bytes[24]),
                       minor));
    }
    read_layout(bytes, minor);
    for (int axis = 0; axis < 3; ++axis) {
      scale_[axis] = load<double>(bytes.data() + 131 + 8 * axis);
      offset_[axis] = load<double>(bytes.data() + 155 + 8 * axis);
      if (!std::isfinite(scale_[axis]) || scale_[axis] == 0.0 || !std::isfinite(offset_[axis])) {
        fail(131 + 8 * static_cast<std::size_t>(axis), "scale or offset is not a usable number");
      }
    }
    const std::size_t header_size = load<std::uint16_t>(bytes.data() + 94);
    if (header_size >= kHeaderSize && header_size <= data_) {
      unit_ = unit_in_las_records(bytes.subspan(header_size, data_ - header_size),
                                  load<std::uint32_t>(bytes.data() + 100));
    }
    look_at_some();
    file_.will_read_sequentially();
  }

  bool read(std::vector<CloudPoint>& batch) override {
    batch.clear();
    for (; batch.size() < kBatch && next_ < points_; ++next_) {
      const std::byte* p = file_.bytes().data() + data_ + next_ * point_size_;
      if (is_flagged(p)) continue;
      CloudPoint& point = batch.emplace_back();
      for (int axis = 0; axis < 3; ++axis) {
        point.position[axis] = load<std::int32_t>(p + 4 * axis) * scale_[axis] + offset_[axis];
      }
      point.intensity = static_cast<float>(load<std::uint16_t>(p + 12));
      if (has_color_) point.color = color_of(p);
    }
    file_.release_before(data_ + next_ * point_size_);
    return !batch.empty();
  }

  [[nodiscard]] bool has_intensity() const override { return has_intensity_; }
  [[nodiscard]] bool has_color() const override { return has_color_; }
  [[nodiscard]] std::optional<FileUnit> unit() const override { return unit_; }
  /// Of flagged points: those that were read so far.
  [[nodiscard]] FileColumns columns() const override {
    FileColumns columns;
    if (has_intensity_) columns.intensity = "intensity";
    columns.left_out = {"returns", "classification", "scan angle"};
    if (has_time_) columns.left_out.emplace_back("gps time");
    if (withheld_ > 0) {
      columns.notes.push_back(fmt::format("{} points that it withholds are left out", withheld_));
    }
    if (noise_ > 0) {
      columns.notes.push_back(
          fmt::format("{} points that it classes as noise (7, 18) are left out", noise_));
    }
    return columns;
  }
  [[nodiscard]] double share_read() const override {
    return points_ == 0 ? 1.0 : static_cast<double>(next_) / static_cast<double>(points_);
  }

 private:
  [[noreturn]] void fail(std::size_t byte, const std::string& what) const {
    throw InputError(fmt::format("{}: byte {}: {}", file_.path(), byte, what));
  }

  void read_layout(std::span<const std::byte> bytes, unsigned minor) {
    const auto format = std::to_integer<unsigned>(bytes[104]);
    if ((format & 0xc0u) != 0) {
      fail(
          104,
          fmt::format("the points are LAZ-compressed; unpack them first: laszip -i {} -o cloud.las",
                      file_.path()));
    }
    if (format > 10) fail(104, fmt::format("point format {} is unknown; 0 to 10", format));
    color_at_ = kColorAt[format];
    has_wide_classes_ = format >= 6;
    has_time_ = format != 0 && format != 2;
    data_ = load<std::uint32_t>(bytes.data() + 96);
    point_size_ = load<std::uint16_t>(bytes.data() + 105);
    if (point_size_ < kMinPointSize[format]) {
      fail(105,
           fmt::format("points of {} bytes; format {} needs {}",
                       point_size_,
                       format,
                       kMinPointSize[format]));
    }
    points_ = load<std::uint32_t>(bytes.data() + 107);
    if (minor >= 4 && bytes.size() >= kHeaderSize14) {
      const auto wide = load<std::uint64_t>(bytes.data() + 247);
      if (wide != 0) points_ = wide;
    }
    if (data_ < kHeaderSize || data_ > bytes.size()) {
      fail(96, fmt::format("the points start at byte {}, outside the file", data_));
    }
    if (points_ > (bytes.size() - data_) / point_size_) {
      fail(bytes.size(),
           fmt::format("the header promises {} points of {} bytes, the file has {}; it is cut off "
                       "or its header is wrong",
                       points_,
                       point_size_,
                       (bytes.size() - data_) / point_size_));
    }
  }

  /// Withheld (a flag of its own), or classed as noise; counted.
  bool is_flagged(const std::byte* point) {
    const auto flags = std::to_integer<unsigned>(point[15]);
    const unsigned number = has_wide_classes_ ? std::to_integer<unsigned>(point[16]) : flags & 31u;
    if ((flags & (has_wide_classes_ ? 4u : 128u)) != 0) {
      ++withheld_;
      return true;
    }
    // low points; since 1.4 high ones as well
    if (number == 7 || (has_wide_classes_ && number == 18)) {
      ++noise_;
      return true;
    }
    return false;
  }

  /// Every point has room for an intensity and, by its format, for a colour; files without them
  /// leave zeros. Colours are to have 16 bits; many files have 8.
  void look_at_some() {
    constexpr std::uint64_t kSample = 1000;
    const std::uint64_t step = std::max<std::uint64_t>(1, points_ / kSample);
    has_intensity_ = points_ == 0;
    unsigned brightest = 0;
    for (std::uint64_t i = 0; i < points_; i += step) {
      const std::byte* p = file_.bytes().data() + data_ + i * point_size_;
      has_intensity_ = has_intensity_ || load<std::uint16_t>(p + 12) != 0;
      for (std::size_t c = 0; c < 3 && color_at_ > 0; ++c) {
        brightest = std::max<unsigned>(brightest, load<std::uint16_t>(p + color_at_ + 2 * c));
      }
    }
    has_color_ = brightest > 0;
    color_shift_ = brightest > 255 ? 8 : 0;
  }

  [[nodiscard]] std::array<std::uint8_t, 3> color_of(const std::byte* point) const {
    std::array<std::uint8_t, 3> color{};
    for (std::size_t c = 0; c < 3; ++c) {
      color[c] =
          static_cast<std::uint8_t>(load<std::uint16_t>(point + color_at_ + 2 * c) >> color_shift_);
    }
    return color;
  }

  MappedFile file_;
  std::uint64_t points_ = 0;
  std::size_t data_ = 0;
  std::size_t point_size_ = 0;
  Vector3d scale_ = Vector3d::Ones();
  Vector3d offset_ = Vector3d::Zero();
  std::uint64_t next_ = 0;
  std::size_t color_at_ = 0;
  unsigned color_shift_ = 0;
  bool has_wide_classes_ = false;  // a byte of its own; before, 5 bits beside the flags
  bool has_time_ = false;
  std::uint64_t withheld_ = 0;
  std::uint64_t noise_ = 0;
  bool has_intensity_ = false;
  bool has_color_ = false;
  std::optional<FileUnit> unit_;
};

}  // namespace

std::unique_ptr<CloudReader> open_las(MappedFile file) {
  return std::make_unique<LasReader>(std::move(file));
}

}  // namespace pointflight
