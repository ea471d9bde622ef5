#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pointflight/core/mapped_file.hpp"

namespace pointflight {

/// How one number of an array is stored.
struct NpyNumber {
  char kind = 'f';          ///< f, i, u, b
  std::size_t size = 4;     ///< bytes
  bool big_endian = false;  ///< Else little.
};

/// Of the bytes at `p`.
double npy_number(const std::byte* p, const NpyNumber& number);

/// What stands before the numbers of NumPy's .npy (NumPy Enhancement Proposal 1): a Python
/// dictionary of literals.
class NpyHeader {
 public:
  /// The file must outlive it. Messages end in `advice`. Throws InputError.
  NpyHeader(const MappedFile& file, std::string advice);

  /// Byte at which the numbers begin.
  [[nodiscard]] std::size_t data() const { return data_; }
  /// Lengths of its dimensions; their product is at most 1e15.
  [[nodiscard]] const std::vector<std::size_t>& shape() const { return shape_; }
  /// The first index runs fastest.
  [[nodiscard]] bool fortran() const { return fortran_; }
  /// The text of its type: '<f4', or a list of fields.
  [[nodiscard]] std::string_view type() const { return value("descr"); }

  /// Of a type without its quotes. Throws InputError if it is no number.
  [[nodiscard]] NpyNumber number_of(std::string_view type) const;
  /// The next text between quotes, which is taken from `text`.
  static std::optional<std::string_view> next_quoted(std::string_view& text);
  /// Throws InputError.
  [[noreturn]] void fail(const std::string& what) const;

 private:
  [[nodiscard]] std::string_view value(std::string_view key) const;
  void read_shape();

  const MappedFile& file_;
  std::string advice_;
  std::string_view text_;
  std::size_t data_ = 0;
  std::vector<std::size_t> shape_;
  bool fortran_ = false;
};

}  // namespace pointflight
