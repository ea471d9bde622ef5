// What ROS 2's environment variables ask for.
#include "pointflight/ros/ros2/discovery.hpp"

#include <gtest/gtest.h>

#include <map>
#include <stdexcept>

namespace pointflight {
namespace {

using Range = DiscoverySettings::Range;

DiscoverySettings with(const std::map<std::string, std::string>& variables) {
  return discovery_from([&](const char* name) {
    const auto found = variables.find(name);
    return found == variables.end() ? std::nullopt : std::optional(found->second);
  });
}

TEST(Discovery, FollowsRosEnvironment) {
  EXPECT_EQ(with({}).domain, 0u);
  EXPECT_EQ(with({}).range, Range::kSubnet);
  EXPECT_FALSE(with({}).old_gids);
  EXPECT_EQ(with({{"ROS_DOMAIN_ID", "42"}}).domain, 42u);
  EXPECT_EQ(with({{"ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"}}).range, Range::kLocalhost);
  EXPECT_EQ(with({{"ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF"}}).range, Range::kOff);
  EXPECT_EQ(with({{"ROS_LOCALHOST_ONLY", "1"}}).range, Range::kLocalhost);
  EXPECT_EQ(with({{"ROS_LOCALHOST_ONLY", "0"}}).range, Range::kSubnet);
  const auto peers = with({{"ROS_STATIC_PEERS", "192.168.1.7;10.0.0.2"}}).static_peers;
  EXPECT_EQ(peers, (std::vector<std::string>{"192.168.1.7", "10.0.0.2"}));
  EXPECT_TRUE(with({{"ROS_DISTRO", "humble"}}).old_gids);
  EXPECT_FALSE(with({{"ROS_DISTRO", "jazzy"}}).old_gids);
  for (const char* domain : {"-1", "233", "one", "7x"}) {
    EXPECT_THROW(with({{"ROS_DOMAIN_ID", domain}}), std::runtime_error) << domain;
  }
  EXPECT_THROW(with({{"ROS_AUTOMATIC_DISCOVERY_RANGE", "NEAR"}}), std::runtime_error);
}

void expect_part(const std::string& text, const std::string& part, bool there = true) {
  EXPECT_EQ(text.find(part) != std::string::npos, there) << part << " in " << text;
}

TEST(Discovery, BecomesCyclonesConfiguration) {
  const std::string subnet = cyclone_configuration(with({}), "");
  expect_part(subnet, "<AllowMulticast>", false);  // as it comes
  expect_part(subnet, "<Peers>", false);
  const std::string localhost =
      cyclone_configuration(with({{"ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"}}), "");
  expect_part(localhost, "<NetworkInterface address=\"127.0.0.1\"/>");
  expect_part(localhost, "<AllowMulticast>false</AllowMulticast>");
  expect_part(localhost, "<Peer address=\"127.0.0.1\"/>");
  const std::string off =
      cyclone_configuration(with({{"ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF"}}), "");
  expect_part(off, "<Tag>off_");
  expect_part(off, "<Peers>", false);
  const std::string peers =
      cyclone_configuration(with({{"ROS_STATIC_PEERS", "192.168.1.7;a<b&\"c"}}), "");
  expect_part(peers, "<Peer address=\"192.168.1.7\"/>");
  expect_part(peers, "<Peer address=\"a&lt;b&amp;&quot;c\"/>");
  // the user's own comes last, and its interfaces instead of ours
  const std::string own =
      "<General><Interfaces><NetworkInterface name='eth0'/></Interfaces></General>";
  const std::string both =
      cyclone_configuration(with({{"ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"}}), own);
  EXPECT_TRUE(both.ends_with("," + own));
  expect_part(both, "<NetworkInterface address=", false);
}

}  // namespace
}  // namespace pointflight
