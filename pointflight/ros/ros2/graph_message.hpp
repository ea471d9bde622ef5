// rmw_dds_common's messages about nodes: what `ros2 node list` reads.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "pointflight/ros/common/codec.hpp"

namespace pointflight {

/// An endpoint's identity: 16 bytes from Iron on; up to Humble 24, the last eight zero.
template <std::size_t N>
struct Gid {
  static constexpr msg::TypeName kType{"rmw_dds_common", "Gid"};
  std::array<std::uint8_t, N> data{};
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("data", m.data);
  }
};

template <std::size_t N>
struct NodeEntitiesInfo {
  static constexpr msg::TypeName kType{"rmw_dds_common", "NodeEntitiesInfo"};
  std::string node_namespace, node_name;
  std::vector<Gid<N>> reader_gid_seq, writer_gid_seq;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("node_namespace", m.node_namespace);
    v("node_name", m.node_name);
    v("reader_gid_seq", m.reader_gid_seq);
    v("writer_gid_seq", m.writer_gid_seq);
  }
};

template <std::size_t N>
struct ParticipantEntitiesInfo {
  static constexpr msg::TypeName kType{"rmw_dds_common", "ParticipantEntitiesInfo"};
  Gid<N> gid;
  std::vector<NodeEntitiesInfo<N>> node_entities_info_seq;
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("gid", m.gid);
    v("node_entities_info_seq", m.node_entities_info_seq);
  }
};

/// Of the 16-byte form, as Jazzy has it (its strings are bounded, which changes no byte on the
/// wire).
inline constexpr const char* kGraphTypeHash =
    "RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e";

using RawGid = std::array<std::uint8_t, 16>;

/// One participant with one node, as CDR.
template <std::size_t N>
std::vector<std::byte> graph_message(const RawGid& participant,
                                     const std::string& node,
                                     std::span<const RawGid> readers,
                                     std::span<const RawGid> writers) {
  const auto gid = [](const RawGid& raw) {
    Gid<N> g;
    std::copy(raw.begin(), raw.end(), g.data.begin());
    return g;
  };
  ParticipantEntitiesInfo<N> info;
  info.gid = gid(participant);
  NodeEntitiesInfo<N> entry;
  entry.node_namespace = "/";
  entry.node_name = node;
  for (const RawGid& raw : readers) entry.reader_gid_seq.push_back(gid(raw));
  for (const RawGid& raw : writers) entry.writer_gid_seq.push_back(gid(raw));
  info.node_entities_info_seq.push_back(std::move(entry));
  return encode<Wire::kCdr>(info);
}

}  // namespace pointflight
