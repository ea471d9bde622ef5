#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "pointflight/io/byte_cursor.hpp"
#include "pointflight/io/formats.hpp"
#include "pointflight/io/internal/column_names.hpp"

// NumPy Enhancement Proposal 1, "A Simple File Format for NumPy Arrays".
namespace pointflight {
namespace {

struct NpyNumber {
  char kind = 'f';       // f, i, u, b
  std::size_t size = 4;  // bytes
  bool big_endian = false;
};

struct NpyColumn {
  std::string name;
  NpyNumber number;
  std::size_t offset = 0;  // bytes from the start of a row
};

/// What stands before the numbers: a Python dictionary of literals.
class NpyHeader {
 public:
  explicit NpyHeader(const MappedFile& file) : file_(file) {
    const auto bytes = file.bytes();
    constexpr std::string_view kMagic = "\x93NUMPY";
    if (bytes.size() < 12 || as_text(bytes).substr(0, 6) != kMagic) {
      fail("does not begin as NumPy's files do");
    }
    const auto version = std::to_integer<unsigned>(bytes[6]);
    const std::size_t head = version == 1 ? 10 : 12;
    const std::size_t size = version == 1 ? load<std::uint16_t>(bytes.data() + 8)
                                          : load<std::uint32_t>(bytes.data() + 8);
    if (version < 1 || version > 3 || size > bytes.size() - head) fail("its header is cut off");
    text_ = as_text(bytes).substr(head, size);
    data = head + size;
    read_shape();
    read_columns();
  }

  std::size_t data = 0;  ///< Byte at which the numbers begin.
  std::size_t rows = 0;
  std::vector<NpyColumn> columns;
  std::size_t row_size = 0;  ///< Bytes; of columns one after the other in Fortran's order 0.
  bool fortran = false;

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(
        fmt::format("{}: {}; save it as float32 or float64 with a row x y z ... for "
                    "each point",
                    file_.path(),
                    what));
  }

  /// The text behind a key and its colon.
  [[nodiscard]] std::string_view value(std::string_view key) const {
    std::size_t at = text_.find(fmt::format("'{}'", key));
    if (at != std::string_view::npos) at = text_.find(':', at);
    if (at == std::string_view::npos) fail(fmt::format("its header lacks '{}'", key));
    const std::string_view rest = text_.substr(at + 1);
    return rest.substr(std::min(rest.size(), rest.find_first_not_of(" \t\n")));
  }

  void read_shape() {
    fortran = value("fortran_order").starts_with("True");
    std::string_view text = value("shape");
    if (!text.starts_with("(")) fail("its shape cannot be read");
    text = text.substr(1, std::min(text.find(')'), text.size()) - 1);
    double numbers = 1.0;  // so few that no product of lengths overflows
    for (auto word = take_word(text); !word.empty(); word = take_word(text)) {
      double number = -1.0;
      if (!parse_number(word, number) || !(number >= 0.0 && number <= 1e15)) {
        fail("its shape cannot be read");
      }
      numbers *= std::max(number, 1.0);
      shape_.push_back(static_cast<std::size_t>(number));
    }
    if (numbers > 1e15) fail("its shape cannot be read");
  }

  NpyNumber number_of(std::string_view type) const {
    double size = 0.0;
    if (type.size() < 3 || std::string_view("<>=|").find(type[0]) == std::string_view::npos ||
        !parse_number(type.substr(2), size) || !is_read(type[1], size)) {
      fail(fmt::format("numbers of the type '{}' are not read", excerpt(type)));
    }
    NpyNumber number;
    number.big_endian = type[0] == '>';
    number.kind = type[1];
    number.size = static_cast<std::size_t>(size);
    return number;
  }

  /// Whether numbers of this kind and size in bytes are read. The size is what a file says: it
  /// may be negative, broken or huge.
  static bool is_read(char kind, double size) {
    if (kind == 'f') return size == 4.0 || size == 8.0;
    return std::string_view("iub").find(kind) != std::string_view::npos &&
           (size == 1.0 || size == 2.0 || size == 4.0 || size == 8.0);
  }

  /// The next text between quotes.
  static std::optional<std::string_view> next_quoted(std::string_view& text) {
    const std::size_t from = text.find('\'');
    if (from == std::string_view::npos) return std::nullopt;
    const std::size_t to = text.find('\'', from + 1);
    if (to == std::string_view::npos) return std::nullopt;
    const std::string_view found = text.substr(from + 1, to - from - 1);
    text.remove_prefix(to + 1);
    return found;
  }

  void read_columns() {
    std::string_view text = value("descr");
    if (text.starts_with("[")) {
      read_fields(text.substr(0, text.find(']')));
      if (shape_.size() != 1) fail("a structured array wants one dimension");
    } else {
      const auto type = next_quoted(text);
      if (!type) fail("its type cannot be read");
      read_plain(number_of(*type));
    }
    rows = shape_[0];
    if (row_size == 0) fail("it has no columns");
    if (rows > (file_.bytes().size() - data) / row_size) {
      fail(fmt::format("its header promises {} rows of {} bytes, the file has {}",
                       rows,
                       row_size,
                       (file_.bytes().size() - data) / row_size));
    }
  }

  /// [('x', '<f4'), ('y', '<f4'), ...]
  void read_fields(std::string_view text) {
    while (const auto name = next_quoted(text)) {
      const auto type = next_quoted(text);
      if (!type) fail("its fields cannot be read");
      const std::string_view rest = text.substr(0, text.find_first_of("')"));
      if (rest.find('(') != std::string_view::npos) fail("fields of several numbers are not read");
      columns.push_back({std::string(*name), number_of(*type), row_size});
      row_size += columns.back().number.size;
    }
  }

  void read_plain(const NpyNumber& number) {
    if (shape_.size() == 3) {  // organised: height, width, numbers
      shape_ = {shape_[0] * shape_[1], shape_[2]};
      if (fortran) fail("three dimensions in Fortran's order are not read");
    }
    constexpr std::size_t kMostColumns = 64;
    if (shape_.size() != 2 || shape_[1] < 3 || shape_[1] > kMostColumns) {
      fail(fmt::format("its shape is ({})", fmt::join(shape_, ", ")));
    }
    const std::vector<std::string> names = {"x", "y", "z", "intensity"};
    for (std::size_t i = 0; i < shape_[1]; ++i) {
      const bool is_named = i < 3 || (i == 3 && shape_[1] == 4);
      columns.push_back({is_named ? names[i] : fmt::format("column {}", i + 1),
                         number,
                         fortran ? i * shape_[0] * number.size : i * number.size});
      row_size += number.size;
    }
  }

  const MappedFile& file_;
  std::string_view text_;
  std::vector<std::size_t> shape_;
};

double npy_number(const std::byte* p, const NpyNumber& number) {
  const bool big = number.big_endian;
  const bool is_signed = number.kind == 'i';
  if (number.kind == 'f') {
    return number.size == 8 ? load<double>(p, big) : static_cast<double>(load<float>(p, big));
  }
  switch (number.size) {
    case 1:
      return is_signed ? load<std::int8_t>(p) : load<std::uint8_t>(p);
    case 2:
      return is_signed ? load<std::int16_t>(p, big) : load<std::uint16_t>(p, big);
    case 4:
      return is_signed ? load<std::int32_t>(p, big) : load<std::uint32_t>(p, big);
    default:
      return is_signed ? static_cast<double>(load<std::int64_t>(p, big))
                       : static_cast<double>(load<std::uint64_t>(p, big));
  }
}

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
    const std::size_t stride = header_.fortran ? column.number.size : header_.row_size;
    return npy_number(file_.bytes().data() + header_.data + column.offset + next_ * stride,
                      column.number);
  }

  MappedFile file_;
  NpyHeader header_;
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
