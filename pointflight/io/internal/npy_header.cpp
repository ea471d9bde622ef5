#include "pointflight/io/internal/npy_header.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "pointflight/io/byte_cursor.hpp"

namespace pointflight {
namespace {

/// Whether numbers of this kind and size in bytes are read. The size is what a file says: it
/// may be negative, broken or huge.
bool is_read(char kind, double size) {
  if (kind == 'f') return size == 4.0 || size == 8.0;
  return std::string_view("iub").find(kind) != std::string_view::npos &&
         (size == 1.0 || size == 2.0 || size == 4.0 || size == 8.0);
}

}  // namespace

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

NpyHeader::NpyHeader(const MappedFile& file, std::string advice)
    : file_(file), advice_(std::move(advice)) {
  const auto bytes = file.bytes();
  constexpr std::string_view kMagic = "\x93NUMPY";
  if (bytes.size() < 12 || as_text(bytes).substr(0, 6) != kMagic) {
    fail("does not begin as NumPy's files do");
  }
  const auto version = std::to_integer<unsigned>(bytes[6]);
  const std::size_t head = version == 1 ? 10 : 12;
  const std::size_t size =
      version == 1 ? load<std::uint16_t>(bytes.data() + 8) : load<std::uint32_t>(bytes.data() + 8);
  if (version < 1 || version > 3 || size > bytes.size() - head) fail("its header is cut off");
  text_ = as_text(bytes).substr(head, size);
  data_ = head + size;
  read_shape();
}

void NpyHeader::fail(const std::string& what) const {
  throw InputError(fmt::format("{}: {}; {}", file_.path(), what, advice_));
}

/// The text behind a key and its colon.
std::string_view NpyHeader::value(std::string_view key) const {
  std::size_t at = text_.find(fmt::format("'{}'", key));
  if (at != std::string_view::npos) at = text_.find(':', at);
  if (at == std::string_view::npos) fail(fmt::format("its header lacks '{}'", key));
  const std::string_view rest = text_.substr(at + 1);
  return rest.substr(std::min(rest.size(), rest.find_first_not_of(" \t\n")));
}

void NpyHeader::read_shape() {
  fortran_ = value("fortran_order").starts_with("True");
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

NpyNumber NpyHeader::number_of(std::string_view type) const {
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

std::optional<std::string_view> NpyHeader::next_quoted(std::string_view& text) {
  const std::size_t from = text.find('\'');
  if (from == std::string_view::npos) return std::nullopt;
  const std::size_t to = text.find('\'', from + 1);
  if (to == std::string_view::npos) return std::nullopt;
  const std::string_view found = text.substr(from + 1, to - from - 1);
  text.remove_prefix(to + 1);
  return found;
}

}  // namespace pointflight
