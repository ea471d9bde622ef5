#include "pointflight/sitl/internal/mavlink.hpp"

#include <algorithm>
#include <bit>

namespace pointflight::mavlink {
namespace {

static_assert(std::endian::native == std::endian::little, "the wire's order");

constexpr std::byte kStart1{0xfe};
constexpr std::byte kStart2{0xfd};
constexpr std::size_t kHeader1 = 6;
constexpr std::size_t kHeader2 = 10;
constexpr std::size_t kCrc = 2;
constexpr std::size_t kSignature = 13;
constexpr unsigned kSigned = 1;  // the one flag that has to be understood

constexpr MessageKind kKinds[] = {Heartbeat::kKind,
                                  RcChannels::kKind,
                                  CommandLong::kKind,
                                  HilActuatorControls::kKind,
                                  HilSensor::kKind,
                                  HilGps::kKind,
                                  HilStateQuaternion::kKind,
                                  DistanceSensor::kKind,
                                  ObstacleDistance::kKind,
                                  Odometry::kKind};

const MessageKind* kind_of(std::uint32_t id) {
  const auto* found = std::find_if(
      std::begin(kKinds), std::end(kKinds), [&](const MessageKind& kind) { return kind.id == id; });
  return found == std::end(kKinds) ? nullptr : found;
}

std::uint8_t number(std::byte byte) {
  return std::to_integer<std::uint8_t>(byte);
}

/// What the beginning of a stream is.
struct Parsed {
  bool is_short = false;              ///< It may be a frame, whose end has not come.
  std::size_t header = 0;             ///< Of the frame, bytes.
  std::size_t payload = 0;            ///< The same.
  std::size_t length = 0;             ///< Of all of it; 0: it is none.
  std::uint32_t id = 0;               ///< Of its message.
  const MessageKind* kind = nullptr;  ///< Of that.
};

/// Junk that looks like the start of a frame must not make a reader wait for its end: what a header
/// says has to fit a known kind.
Parsed parse(std::span<const std::byte> bytes) {
  const bool is_second = bytes[0] == kStart2;
  if (!is_second && bytes[0] != kStart1) return {};
  Parsed parsed;
  parsed.header = is_second ? kHeader2 : kHeader1;
  parsed.is_short = bytes.size() < parsed.header;
  if (parsed.is_short) return parsed;
  const unsigned flags = is_second ? number(bytes[2]) : 0u;
  for (std::size_t i = is_second ? 7 : 5; i < parsed.header; ++i) {
    const std::size_t shift = 8 * (i - (is_second ? 7 : 5));
    parsed.id |= static_cast<std::uint32_t>(number(bytes[i])) << shift;
  }
  parsed.kind = kind_of(parsed.id);
  parsed.payload = number(bytes[1]);
  if ((flags & ~kSigned) != 0 || parsed.kind == nullptr) return {};
  if (parsed.payload > parsed.kind->length) return {};
  const std::size_t tail = (flags & kSigned) != 0 ? kSignature : 0;
  parsed.length = parsed.header + parsed.payload + kCrc + tail;
  parsed.is_short = bytes.size() < parsed.length;
  return parsed;
}

/// The frame at the beginning of a stream, if nothing has changed it.
std::optional<Frame> frame_of(std::span<const std::byte> bytes, const Parsed& parsed) {
  const std::byte extra[] = {std::byte{parsed.kind->crc_extra}};
  const std::uint16_t crc =
      checksum(extra, checksum(bytes.subspan(1, parsed.header - 1 + parsed.payload)));
  const auto sent = bytes.subspan(parsed.header + parsed.payload, kCrc);
  if (number(sent[0]) != (crc & 0xffu) || number(sent[1]) != crc >> 8u) return std::nullopt;
  const std::size_t at = parsed.header == kHeader2 ? 4 : 2;  // of the sequence number
  const auto content = bytes.subspan(parsed.header, parsed.payload);
  return Frame{parsed.id,
               number(bytes[at + 1]),
               number(bytes[at + 2]),
               number(bytes[at]),
               {content.begin(), content.end()}};
}

}  // namespace

std::uint16_t checksum(std::span<const std::byte> bytes, std::uint16_t crc) {
  for (const std::byte byte : bytes) {
    auto mixed = static_cast<std::uint8_t>(number(byte) ^ (crc & 0xffu));
    mixed = static_cast<std::uint8_t>(mixed ^ (mixed << 4u));
    crc = static_cast<std::uint16_t>((crc >> 8u) ^ (mixed << 8u) ^ (mixed << 3u) ^ (mixed >> 4u));
  }
  return crc;
}

void FrameReader::add(std::span<const std::byte> bytes) {
  bytes_.erase(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(begin_));
  begin_ = 0;
  bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
}

std::optional<Frame> FrameReader::next() {
  while (begin_ < bytes_.size()) {
    const auto left = std::span(bytes_).subspan(begin_);
    const Parsed parsed = parse(left);
    if (parsed.is_short) return std::nullopt;
    if (parsed.length > 0) {
      if (auto frame = frame_of(left, parsed)) {
        begin_ += parsed.length;
        return frame;
      }
    }
    ++begin_;
    ++dropped_;
  }
  return std::nullopt;
}

void FrameWriter::append(const MessageKind& kind, std::vector<std::byte>& stream) {
  while (payload_.size() > 1 && payload_.back() == std::byte{0}) payload_.pop_back();
  const std::size_t start = stream.size();
  const auto put_byte = [&](std::uint32_t value) {
    stream.push_back(static_cast<std::byte>(value & 0xffu));
  };
  stream.push_back(kStart2);
  put_byte(static_cast<std::uint32_t>(payload_.size()));
  put_byte(0);
  put_byte(0);
  put_byte(sequence_++);
  put_byte(system_);
  put_byte(component_);
  for (const unsigned shift : {0u, 8u, 16u}) put_byte(kind.id >> shift);
  stream.insert(stream.end(), payload_.begin(), payload_.end());
  const std::byte extra[] = {std::byte{kind.crc_extra}};
  const std::uint16_t crc = checksum(extra, checksum(std::span(stream).subspan(start + 1)));
  put_byte(crc);
  put_byte(crc >> 8u);
}

}  // namespace pointflight::mavlink
