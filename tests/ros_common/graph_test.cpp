// rmw_dds_common's message about a node, byte by byte.
#include <gtest/gtest.h>

#include "pointflight/ros/ros2/graph_message.hpp"

namespace pointflight {
namespace {

TEST(Graph, BothFormsOfItsIdentities) {
  RawGid own{};
  RawGid writer{};
  for (std::size_t i = 0; i < own.size(); ++i) {
    own[i] = static_cast<std::uint8_t>(i);
    writer[i] = static_cast<std::uint8_t>(0x40 + i);
  }
  const std::vector<RawGid> writers = {writer};
  const auto now = graph_message<16>(own, "n", {}, writers);
  const auto old = graph_message<24>(own, "n", {}, writers);
  // header 4, gid, count 4, "/" 4+2 and "n" 4+2 aligned to 4 each, two sequences
  EXPECT_EQ(now.size(), 4u + 16 + 4 + 8 + 8 + 4 + 4 + 16);
  EXPECT_EQ(old.size(), 4u + 24 + 4 + 8 + 8 + 4 + 4 + 24);
  EXPECT_EQ(now[4 + 15], std::byte{15});
  EXPECT_EQ(old[4 + 23], std::byte{0});
  EXPECT_EQ(now.back(), std::byte{0x4f});
  EXPECT_EQ(old.back(), std::byte{0});
}

}  // namespace
}  // namespace pointflight
