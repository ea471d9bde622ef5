#include "pointflight/io/internal/e57_records.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "pointflight/io/byte_cursor.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kE57Section = 32;
constexpr std::size_t kE57PacketHeader = 6;
enum E57Packet : unsigned { kIndexPacket = 0, kDataPacket = 1, kEmptyPacket = 2 };

/// `bits` from a bit on, the lowest first; what is beyond the end is 0.
std::uint64_t bits_at(const std::vector<std::byte>& bytes, std::uint64_t bit, unsigned bits) {
  std::uint64_t value = 0;
  for (unsigned got = 0; got < bits;) {
    const std::uint64_t at = (bit + got) / 8;
    const auto skip = static_cast<unsigned>((bit + got) % 8);
    const std::uint64_t byte = at < bytes.size() ? std::to_integer<std::uint64_t>(bytes[at]) : 0;
    value |= (byte >> skip) << got;
    got += 8 - skip;
  }
  return bits == 64 ? value : value & ((std::uint64_t{1} << bits) - 1);
}

}  // namespace

E57Records::E57Records(const E57Pages& pages, const E57Scan& scan, std::vector<std::size_t> wanted)
    : pages_(pages),
      scan_(scan),
      wanted_(std::move(wanted)),
      streams_(wanted_.size()),
      values_(wanted_.size()),
      left_(scan.points) {
  if (left_ == 0) return;
  const std::uint64_t section = pages_.logical(scan.section);
  pages_.read(section, kE57Section, packet_);
  if (std::to_integer<unsigned>(packet_[0]) != 1) {
    pages_.fail(section, "no section of points begins here, as the XML says");
  }
  const auto length = load<std::uint64_t>(packet_.data() + 8);
  if (length > pages_.size() - section) {
    pages_.fail(section, fmt::format("a section of {} bytes ends beyond the file", length));
  }
  end_ = section + length;
  offset_ = pages_.logical(load<std::uint64_t>(packet_.data() + 16));
}

std::uint64_t E57Records::values_in(std::size_t i) const {
  const unsigned bits = scan_.fields[wanted_[i]].bits;
  // a field of one value takes no room
  if (bits == 0) return std::numeric_limits<std::uint64_t>::max();
  return (8 * streams_[i].bytes.size() - streams_[i].bit) / bits;
}

bool E57Records::next() {
  size_ = 0;
  while (left_ > 0 && size_ == 0) {
    read_packet();
    std::uint64_t whole = left_;
    for (std::size_t i = 0; i < wanted_.size(); ++i) whole = std::min(whole, values_in(i));
    // fields of one value each have no end of their own
    constexpr std::uint64_t kMost = 1u << 16;
    size_ = static_cast<std::size_t>(std::min(whole, kMost));
    for (std::size_t i = 0; i < wanted_.size(); ++i) decode(i, size_);
    left_ -= size_;
  }
  return size_ > 0;
}

void E57Records::read_packet() {
  if (offset_ + 4 > end_) {
    pages_.fail(offset_,
                fmt::format("the section of '{}' ends here, {} of its {} points are missing",
                            excerpt(scan_.name),
                            left_,
                            scan_.points));
  }
  pages_.read(offset_, 4, packet_);
  const auto kind = std::to_integer<unsigned>(packet_[0]);
  const std::size_t length = std::size_t{load<std::uint16_t>(packet_.data() + 2)} + 1;
  if (kind > kEmptyPacket || length % 4 != 0) {
    pages_.fail(offset_, fmt::format("a packet of kind {} and {} bytes", kind, length));
  }
  const std::uint64_t begin = offset_;
  pages_.read(begin, length, packet_);
  offset_ += length;
  if (kind != kDataPacket) return;

  const std::size_t fields = scan_.fields.size();
  std::size_t at = kE57PacketHeader + 2 * fields;
  if (length < at || load<std::uint16_t>(packet_.data() + 4) != fields) {
    pages_.fail(begin, fmt::format("a packet with streams of {} fields is wanted", fields));
  }
  for (std::size_t field = 0; field < fields; ++field) {
    const std::size_t size = load<std::uint16_t>(packet_.data() + kE57PacketHeader + 2 * field);
    if (size > length - at) pages_.fail(begin, "a packet's streams are longer than the packet");
    for (std::size_t i = 0; i < wanted_.size(); ++i) {
      if (wanted_[i] != field) continue;
      const auto* from = packet_.data() + at;
      streams_[i].bytes.insert(streams_[i].bytes.end(), from, from + size);
    }
    at += size;
  }
}

void E57Records::decode(std::size_t i, std::size_t count) {
  const E57Field& field = scan_.fields[wanted_[i]];
  Stream& stream = streams_[i];
  values_[i].resize(count);
  for (double& value : values_[i]) {
    value = field.value(bits_at(stream.bytes, stream.bit, field.bits));
    stream.bit += field.bits;
  }
  const std::uint64_t done = stream.bit / 8;
  stream.bytes.erase(stream.bytes.begin(),
                     stream.bytes.begin() + static_cast<std::ptrdiff_t>(done));
  stream.bit %= 8;
}

}  // namespace pointflight
