#include "pointflight/io/internal/e57_pages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "pointflight/core/input_error.hpp"
#include "pointflight/io/byte_cursor.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kE57Header = 48;
constexpr std::uint64_t kChecksum = 4;

/// Tables for eight bytes at a time ("slicing by 8", Kounavis and Berry 2008).
constexpr auto kCrcTables = [] {
  constexpr std::uint32_t kCastagnoli = 0x82f63b78;  // reflected
  std::array<std::array<std::uint32_t, 256>, 8> tables{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t crc = byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1u) != 0 ? kCastagnoli : 0u);
    tables[0][byte] = crc;
  }
  for (std::size_t slice = 1; slice < 8; ++slice) {
    for (std::size_t byte = 0; byte < 256; ++byte) {
      const std::uint32_t before = tables[slice - 1][byte];
      tables[slice][byte] = (before >> 8) ^ tables[0][before & 255u];
    }
  }
  return tables;
}();

}  // namespace

std::uint32_t crc32c(std::span<const std::byte> bytes) {
  std::uint32_t crc = 0xffffffff;
  for (; bytes.size() >= 8; bytes = bytes.subspan(8)) {
    const std::uint32_t low = crc ^ load<std::uint32_t>(bytes.data());
    const auto high = load<std::uint32_t>(bytes.data() + 4);
    crc = kCrcTables[7][low & 255u] ^ kCrcTables[6][(low >> 8) & 255u] ^
          kCrcTables[5][(low >> 16) & 255u] ^ kCrcTables[4][low >> 24] ^
          kCrcTables[3][high & 255u] ^ kCrcTables[2][(high >> 8) & 255u] ^
          kCrcTables[1][(high >> 16) & 255u] ^ kCrcTables[0][high >> 24];
  }
  for (const std::byte byte : bytes) {
    crc = (crc >> 8) ^ kCrcTables[0][(crc ^ std::to_integer<std::uint32_t>(byte)) & 255u];
  }
  return ~crc;
}

E57Pages::E57Pages(MappedFile file) : file_(std::move(file)) {
  const auto bytes = file_.bytes();
  const auto refuse = [&](std::size_t byte, const std::string& what) {
    throw InputError(fmt::format("{}: byte {}: {}", path(), byte, what));
  };
  if (bytes.size() < kE57Header || as_text(bytes.subspan(0, 8)) != "ASTM-E57") {
    refuse(0, "does not start with an E57 header ('ASTM-E57', 48 bytes)");
  }
  const auto major = load<std::uint32_t>(bytes.data() + 8);
  if (major != 1) refuse(8, fmt::format("E57 version {}; 1 is read", major));
  const auto length = load<std::uint64_t>(bytes.data() + 16);
  if (length > bytes.size()) {
    refuse(
        16,
        fmt::format(
            "the header promises {} bytes, the file has {}; it is cut off", length, bytes.size()));
  }
  xml_offset_ = load<std::uint64_t>(bytes.data() + 24);
  xml_length_ = load<std::uint64_t>(bytes.data() + 32);
  page_size_ = load<std::uint64_t>(bytes.data() + 40);
  constexpr std::uint64_t kMostPage = 1u << 20;
  if (page_size_ < 64 || page_size_ > kMostPage || page_size_ % 4 != 0) {
    refuse(40, fmt::format("pages of {} bytes; 1024 are usual", page_size_));
  }
}

std::uint64_t E57Pages::payload() const {
  return page_size_ - kChecksum;
}

std::uint64_t E57Pages::size() const {
  return file_.bytes().size() / page_size_ * payload();
}

std::uint64_t E57Pages::physical(std::uint64_t logical) const {
  return logical / payload() * page_size_ + logical % payload();
}

std::uint64_t E57Pages::logical(std::uint64_t physical) const {
  const std::uint64_t in_page = physical % page_size_;
  if (physical >= file_.bytes().size() || in_page >= payload()) {
    throw InputError(
        fmt::format("{}: byte {}: is named as a section's begin, but lies {}",
                    path(),
                    physical,
                    in_page >= payload() ? "amid a page's checksum" : "beyond the file's end"));
  }
  return physical / page_size_ * payload() + in_page;
}

void E57Pages::fail(std::uint64_t offset, const std::string& what) const {
  throw InputError(fmt::format("{}: byte {}: {}", path(), physical(offset), what));
}

void E57Pages::check_page(std::uint64_t page) const {
  const auto bytes = file_.bytes().subspan(page * page_size_, page_size_);
  const auto stored = load<std::uint32_t>(bytes.data() + payload(), true);  // big-endian, it alone
  if (crc32c(bytes.first(payload())) == stored) return;
  throw InputError(
      fmt::format("{}: byte {}: the checksum of this page is wrong; the file is damaged",
                  path(),
                  page * page_size_));
}

void E57Pages::read(std::uint64_t offset, std::size_t length, std::vector<std::byte>& bytes) const {
  if (offset > size() || length > size() - offset) {
    fail(offset, fmt::format("{} bytes are to follow, which are beyond the file's end", length));
  }
  bytes.resize(length);
  for (std::size_t done = 0; done < length;) {
    const std::uint64_t page = (offset + done) / payload();
    const std::uint64_t in_page = (offset + done) % payload();
    const std::size_t part = std::min<std::size_t>(length - done, payload() - in_page);
    check_page(page);
    const auto from = file_.bytes().subspan(page * page_size_ + in_page, part);
    std::copy(from.begin(), from.end(), bytes.begin() + static_cast<std::ptrdiff_t>(done));
    done += part;
  }
}

void E57Pages::release_before(std::uint64_t offset) const {
  file_.release_before(physical(offset));
}

std::string E57Pages::xml() const {
  std::vector<std::byte> bytes;
  read(logical(xml_offset_), xml_length_, bytes);
  return std::string(as_text(bytes));
}

}  // namespace pointflight
