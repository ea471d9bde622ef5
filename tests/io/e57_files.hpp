// E57 files, as tests write them: bit by bit and page by page, in another way than they are read.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace pointflight::testing {

/// A field of points: how the XML states it, how many bits a value takes, the stored values.
struct E57TestField {
  std::string element;  ///< `cartesianX type="Float" precision="single"`
  unsigned bits = 32;
  std::vector<std::uint64_t> stored;
};

/// What a scan has: XML beside its points, and the points.
struct E57TestScan {
  std::vector<E57TestField> fields;
  std::string xml;                 ///< `<name ...>` and `<pose>`
  std::size_t bytes_a_packet = 7;  ///< Of the first stream; the i-th takes i more.
};

inline std::uint64_t float_bits(float value) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return bits;
}

inline std::uint64_t double_bits(double value) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return bits;
}

template <class T>
std::string little_endian(T value) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  return bytes;
}

/// CRC-32C bit by bit.
inline std::uint32_t slow_crc32c(const std::string& bytes) {
  std::uint32_t crc = 0xffffffff;
  for (const char c : bytes) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1u) != 0 ? 0x82f63b78u : 0u);
  }
  return ~crc;
}

/// The stream of a field: its values' bits one after the other, the lowest first.
inline std::string stream_of(const E57TestField& field) {
  std::vector<bool> bits;
  for (const std::uint64_t value : field.stored) {
    for (unsigned bit = 0; bit < field.bits; ++bit) bits.push_back(((value >> bit) & 1u) != 0);
  }
  std::string bytes((bits.size() + 7) / 8, '\0');
  for (std::size_t i = 0; i < bits.size(); ++i) {
    if (bits[i]) bytes[i / 8] = static_cast<char>(bytes[i / 8] | (1 << (i % 8)));
  }
  return bytes;
}

/// Logical offset to physical.
inline std::uint64_t e57_physical(std::uint64_t logical) {
  return logical + logical / 1020 * 4;
}

/// A section of points that begins at the logical offset `at`: an index packet, data, an empty
/// packet amid them.
inline std::string e57_section(const E57TestScan& scan, std::uint64_t at) {
  std::vector<std::string> streams;
  for (const E57TestField& field : scan.fields) streams.push_back(stream_of(field));
  std::string packets;
  packets += std::string("\2\0\3\0", 4);  // empty
  bool some = true;
  while (some) {
    some = false;
    std::string lengths;
    std::string data;
    for (std::size_t i = 0; i < streams.size(); ++i) {
      const std::string part = streams[i].substr(0, scan.bytes_a_packet + i);
      streams[i].erase(0, part.size());
      lengths += little_endian(static_cast<std::uint16_t>(part.size()));
      data += part;
      some = some || !streams[i].empty();
    }
    std::string packet = lengths + data;
    packet.resize((packet.size() + 6 + 3) / 4 * 4 - 6, '\0');
    packets += std::string("\1\0", 2) +
               little_endian(static_cast<std::uint16_t>(packet.size() + 5)) +
               little_endian(static_cast<std::uint16_t>(streams.size())) + packet;
  }
  std::string index(32, '\0');  // one entry, which readers that go front to back leave
  index[2] = 31;
  index[4] = 1;
  packets += index;
  return std::string("\1\0\0\0\0\0\0\0", 8) + little_endian<std::uint64_t>(32 + packets.size()) +
         little_endian<std::uint64_t>(e57_physical(at + 32)) + little_endian<std::uint64_t>(0) +
         packets;
}

/// Pages of 1,024 bytes, each with its checksum.
inline std::string e57_pages(std::string logical) {
  logical.resize((logical.size() + 1019) / 1020 * 1020, '\0');
  std::string file;
  for (std::size_t page = 0; page < logical.size(); page += 1020) {
    const std::string payload = logical.substr(page, 1020);
    const std::uint32_t crc = slow_crc32c(payload);
    file += payload;
    for (int byte = 3; byte >= 0; --byte) file += static_cast<char>((crc >> (8 * byte)) & 255u);
  }
  return file;
}

inline std::string e57_file(const std::vector<E57TestScan>& scans) {
  std::string sections;
  std::string list;
  for (const E57TestScan& scan : scans) {
    const std::uint64_t at = 48 + sections.size();
    std::string prototype;
    for (const E57TestField& field : scan.fields) prototype += "<" + field.element + "/>";
    list += "<vectorChild type=\"Structure\">" + scan.xml +
            "<points type=\"CompressedVector\" fileOffset=\"" + std::to_string(e57_physical(at)) +
            "\" recordCount=\"" + std::to_string(scan.fields[0].stored.size()) +
            "\"><prototype type=\"Structure\">" + prototype +
            "</prototype><codecs type=\"Vector\" allowHeterogeneousChildren=\"1\"/></points>"
            "</vectorChild>\n";
    sections += e57_section(scan, at);
  }
  const std::string xml =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<e57Root type=\"Structure\" xmlns=\"http://www.astm.org/COMMIT/E57/2010-e57-v1.0\">\n"
      "<formatName type=\"String\"><![CDATA[ASTM E57 3D Imaging Data File]]></formatName>\n"
      "<guid type=\"String\"><![CDATA[{0}]]></guid>\n"
      "<versionMajor type=\"Integer\">1</versionMajor><versionMinor type=\"Integer\"/>\n"
      "<data3D type=\"Vector\" allowHeterogeneousChildren=\"1\">\n" +
      list +
      "</data3D>\n<images2D type=\"Vector\" allowHeterogeneousChildren=\"1\"/>\n</e57Root>\n";
  const std::uint64_t xml_at = 48 + sections.size();
  const std::uint64_t pages = (xml_at + xml.size() + 1019) / 1020;
  const std::string header =
      "ASTM-E57" + little_endian<std::uint32_t>(1) + little_endian<std::uint32_t>(0) +
      little_endian<std::uint64_t>(pages * 1024) +
      little_endian<std::uint64_t>(e57_physical(xml_at)) +
      little_endian<std::uint64_t>(xml.size()) + little_endian<std::uint64_t>(1024);
  return e57_pages(header + sections + xml);
}

}  // namespace pointflight::testing
