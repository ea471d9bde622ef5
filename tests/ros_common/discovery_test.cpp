// What ROS 2's environment variables ask for.
#include "ros2/discovery.hpp"

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

}  // namespace
}  // namespace pointflight
