#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/formats.hpp"
#include "pointflight/io/internal/column_names.hpp"
#include "pointflight/io/internal/npy_header.hpp"

namespace pointflight {
namespace {

struct NpyColumn {
  std::string name;
  NpyNumber number;
  std::size_t offset = 0;  // bytes from the start of a row
};

/// What an array's header says of a cloud.
class CloudHeader {
 public:
  explicit CloudHeader(const MappedFile& file)
      : file_(file),
        header_(file, "save it as float32 or float64 with a row x y z ... for each point"),
        shape_(header_.shape()) {
    read_columns();
  }

  [[nodiscard]] std::size_t data() const { return header_.data(); }
  [[nodiscard]] bool fortran() const { return header_.fortran(); }

  std::size_t rows = 0;
  std::vector<NpyColumn> columns;
  std::size_t row_size = 0;  ///< Bytes; of columns one after the other in Fortran's order 0.

 private:
  void read_columns() {
    std::string_view text = header_.type();
    if (text.starts_with("[")) {
      read_fields(text.substr(0, text.find(']')));
      if (shape_.size() != 1) header_.fail("a structured array wants one dimension");
    } else {
      const auto type = NpyHeader::next_quoted(text);
      if (!type) header_.fail("its type cannot be read");
      read_plain(header_.number_of(*type));
    }
    rows = shape_[0];
    if (row_size == 0) header_.fail("it has no columns");
    if (rows > (file_.bytes().size() - data()) / row_size) {
      header_.fail(fmt::format("its header promises {} rows of {} bytes, the file has {}",
                               rows,
                               row_size,
                               (file_.bytes().size() - data()) / row_size));
    }
  }

  /// [('x', '<f4'), ('y', '<f4'), ...]
  void read_fields(std::string_view text) {
    while (const auto name = NpyHeader::next_quoted(text)) {
      const auto type = NpyHeader::next_quoted(text);
      if (!type) header_.fail("its fields cannot be read");
      const std::string_view rest = text.substr(0, text.find_first_of("')"));
      if (rest.find('(') != std::string_view::npos)
        header_.fail("fields of several numbers are not read");
      columns.push_back({std::string(*name), header_.number_of(*type), row_size});
      row_size += columns.back().number.size;
    }
  }

  void read_plain(const NpyNumber& number) {
    if (shape_.size() == 3) {  // organised: height, width, numbers
      shape_ = {shape_[0] * shape_[1], shape_[2]};
      if (fortran()) header_.fail("three dimensions in Fortran's order are not read");
    }
    constexpr std::size_t kMostColumns = 64;
    if (shape_.size() != 2 || shape_[1] < 3 || shape_[1] > kMostColumns) {
      header_.fail(fmt::format("its shape is ({})", fmt::join(shape_, ", ")));
    }
    const std::vector<std::string> names = {"x", "y", "z", "intensity"};
    for (std::size_t i = 0; i < shape_[1]; ++i) {
      const bool is_named = i < 3 || (i == 3 && shape_[1] == 4);
      columns.push_back({is_named ? names[i] : fmt::format("column {}", i + 1),
                         number,
                         fortran() ? i * shape_[0] * number.size : i * number.size});
      row_size += number.size;
    }
  }

  const MappedFile& file_;
  NpyHeader header_;
  std::vector<std::size_t> shape_;
};

class NpyReader : public CloudReader {
 public:
  explicit NpyReader(MappedFile file) : file_(std::move(file)), header_(file_) {
    std::vector<std::string> names;
    for (const NpyColumn& column : header_.columns) names.push_back(column.name);
    const NamedColumns columns(names);
    if (!columns.has_position()) {
      throw InputError(fmt::format("{}: no fields x, y and z; it has: {}",
                                   file_.path(),
                                   excerpt(fmt::format("{}", fmt::join(names, ", ")), 100)));
    }
    for (std::size_t i = 0; i < 3; ++i) {
      position_[i] = header_.columns[columns.at(static_cast<ColumnRole>(i))];
    }
    if (const auto i = columns.find(ColumnRole::kIntensity)) intensity_ = header_.columns[*i];
    about_ = columns.about();
    file_.will_read_sequentially();
  }

  bool read(std::vector<CloudPoint>& batch) override {
    batch.clear();
    for (; batch.size() < kBatch && next_ < header_.rows; ++next_) {
      CloudPoint& point = batch.emplace_back();
      for (std::size_t axis = 0; axis < 3; ++axis) {
        point.position[static_cast<int>(axis)] = number(position_[axis]);
      }
      if (intensity_) point.intensity = static_cast<float>(number(*intensity_));
    }
    return !batch.empty();
  }

  [[nodiscard]] bool has_intensity() const override { return intensity_.has_value(); }
  [[nodiscard]] FileColumns columns() const override { return about_; }
  [[nodiscard]] double share_read() const override {
    return header_.rows == 0 ? 1.0 : static_cast<double>(next_) / static_cast<double>(header_.rows);
  }

 private:
  /// Of the next row.
  [[nodiscard]] double number(const NpyColumn& column) const {
    const std::size_t stride = header_.fortran() ? column.number.size : header_.row_size;
    return npy_number(file_.bytes().data() + header_.data() + column.offset + next_ * stride,
                      column.number);
  }

  MappedFile file_;
  CloudHeader header_;
  std::array<NpyColumn, 3> position_;
  std::optional<NpyColumn> intensity_;
  FileColumns about_;
  std::size_t next_ = 0;
};

}  // namespace

std::unique_ptr<CloudReader> open_npy(MappedFile file) {
  return std::make_unique<NpyReader>(std::move(file));
}

}  // namespace pointflight
