#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "pointflight/io/internal/e57_pages.hpp"
#include "pointflight/io/internal/e57_scans.hpp"

namespace pointflight {

/// The points of one scan, front to back: packets hold a piece of each field's stream, and not as
/// many values of one as of another.
class E57Records {
 public:
  /// `wanted`: numbers of the fields whose values are asked for. `pages` and `scan` must outlive
  /// it. Throws InputError if the scan's section is not where the XML says.
  E57Records(const E57Pages& pages, const E57Scan& scan, std::vector<std::size_t> wanted);

  /// Reads packets until there are points to give; false after the last point. Throws InputError if
  /// a packet is damaged or the section ends too early.
  bool next();

  /// Points that `next` found, at least one.
  [[nodiscard]] std::size_t size() const { return size_; }
  /// Their values of the i-th wanted field.
  [[nodiscard]] const std::vector<double>& values(std::size_t i) const { return values_[i]; }
  /// The logical offset up to which the file is read.
  [[nodiscard]] std::uint64_t offset() const { return offset_; }

 private:
  struct Stream {
    std::vector<std::byte> bytes;  // not yet decoded whole
    std::uint64_t bit = 0;         // of `bytes`, where the next value begins
  };

  void read_packet();
  [[nodiscard]] std::uint64_t values_in(std::size_t i) const;
  void decode(std::size_t i, std::size_t count);

  const E57Pages& pages_;
  const E57Scan& scan_;
  std::vector<std::size_t> wanted_;
  std::vector<Stream> streams_;  // of the wanted fields
  std::vector<std::vector<double>> values_;
  std::vector<std::byte> packet_;
  std::uint64_t offset_ = 0;
  std::uint64_t end_ = 0;  // of the section
  std::uint64_t left_ = 0;
  std::size_t size_ = 0;
};

}  // namespace pointflight
