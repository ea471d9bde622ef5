#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "pointflight/core/mapped_file.hpp"

namespace pointflight {

/// The bytes of an E57 file without the checksums that end each of its pages (ASTM E2807). Offsets
/// in the file count the checksums (physical), lengths do not (logical).
class E57Pages {
 public:
  /// Throws InputError if the file does not begin with an E57 header of version 1.
  explicit E57Pages(MappedFile file);

  /// The text of the XML section. Throws InputError if it is outside the file or damaged.
  [[nodiscard]] std::string xml() const;

  /// The logical offset of a physical one. Throws InputError if that is outside the file or amid a
  /// checksum.
  [[nodiscard]] std::uint64_t logical(std::uint64_t physical) const;

  /// Puts `length` bytes from a logical offset into `bytes`, in place of what was there. Throws
  /// InputError if the file is too short or the checksum of a page is wrong.
  void read(std::uint64_t offset, std::size_t length, std::vector<std::byte>& bytes) const;

  /// Gives back the memory of what lies before a logical offset.
  void release_before(std::uint64_t offset) const;

  /// Throws InputError with the byte of the file at this logical offset.
  [[noreturn]] void fail(std::uint64_t offset, const std::string& what) const;

  /// All bytes but the checksums.
  [[nodiscard]] std::uint64_t size() const;
  /// The file's path, for messages.
  [[nodiscard]] const std::string& path() const { return file_.path(); }

 private:
  [[nodiscard]] std::uint64_t payload() const;
  [[nodiscard]] std::uint64_t physical(std::uint64_t logical) const;
  void check_page(std::uint64_t page) const;

  MappedFile file_;
  std::uint64_t page_size_ = 1024;
  std::uint64_t xml_offset_ = 0;  // physical
  std::uint64_t xml_length_ = 0;
};

/// CRC-32C (Castagnoli, reflected, RFC 3720 B.4), which E57 pages end with.
std::uint32_t crc32c(std::span<const std::byte> bytes);

}  // namespace pointflight
