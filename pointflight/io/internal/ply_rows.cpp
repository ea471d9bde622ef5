#include "pointflight/io/internal/ply_rows.hpp"

#include <fmt/format.h>

namespace pointflight {

PlyRows::PlyRows(const MappedFile& file, const PlyHeader& header)
    : file_(&file),
      header_(&header),
      at_(header.data_offset),
      lines_(as_text(file.bytes()).substr(header.data_offset)) {}

std::size_t PlyRows::offset() const {
  return header_->ascii ? header_->data_offset + lines_.offset() : at_;
}

std::string PlyRows::location() const {
  if (!header_->ascii) return fmt::format("{}: byte {}", file_->path(), at_);
  return fmt::format("{}:{}", file_->path(), header_->data_line + lines_.number());
}

void PlyRows::fail(const std::string& what) const {
  throw InputError(fmt::format("{}: {}", location(), what));
}

void PlyRows::skip(const PlyElement& element) {
  std::vector<double> values;
  std::vector<double> list;
  for (std::uint64_t i = 0; i < element.count; ++i) read(element, values, list);
}

void PlyRows::read(const PlyElement& element,
                   std::vector<double>& values,
                   std::vector<double>& list,
                   std::size_t list_column) {
  values.assign(element.properties.size(), 0.0);
  list.clear();
  if (header_->ascii) {
    read_ascii(element, values, list, list_column);
  } else {
    read_binary(element, values, list, list_column);
  }
}

void PlyRows::read_binary(const PlyElement& element,
                          std::vector<double>& values,
                          std::vector<double>& list,
                          std::size_t list_column) {
  for (std::size_t i = 0; i < element.properties.size(); ++i) {
    const PlyProperty& property = element.properties[i];
    if (!property.count_type) {
      values[i] = take(property.type);
      continue;
    }
    const double items = take(*property.count_type);
    const double bytes = items * static_cast<double>(size_of(property.type));
    if (!(items >= 0.0) || bytes > static_cast<double>(file_->bytes().size() - at_)) {
      fail("a list is longer than the file");
    }
    if (i != list_column) {
      at_ += static_cast<std::size_t>(bytes);
      continue;
    }
    for (auto k = static_cast<std::uint64_t>(items); k > 0; --k)
      list.push_back(take(property.type));
  }
}

double PlyRows::take(PlyScalar type) {
  const std::size_t size = size_of(type);
  if (size > file_->bytes().size() - at_) fail("the file is cut off");
  const double value = load_scalar(file_->bytes().data() + at_, type, header_->big_endian);
  at_ += size;
  return value;
}

void PlyRows::read_ascii(const PlyElement& element,
                         std::vector<double>& values,
                         std::vector<double>& list,
                         std::size_t list_column) {
  std::string_view line;
  do {
    if (!lines_.next(line)) {
      fail(fmt::format(
          "the file ends before its {} '{}' rows are complete", element.count, element.name));
    }
  } while (line.find_first_not_of(" \t") == std::string_view::npos);
  for (std::size_t i = 0; i < element.properties.size(); ++i) {
    const double value = number(line);
    if (!element.properties[i].count_type) {
      values[i] = value;
      continue;
    }
    if (!(value >= 0.0) || value > static_cast<double>(line.size())) {
      fail("a list's length does not fit its line");
    }
    for (auto k = static_cast<std::uint64_t>(value); k > 0; --k) {
      const double item = number(line);
      if (i == list_column) list.push_back(item);
    }
  }
}

double PlyRows::number(std::string_view& line) {
  const std::string_view word = take_word(line);
  double value = 0.0;
  if (!parse_number(word, value)) {
    fail(word.empty() ? std::string("too few numbers")
                      : fmt::format("'{}' is no number", excerpt(word)));
  }
  return value;
}

}  // namespace pointflight
