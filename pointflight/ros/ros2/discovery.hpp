#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace pointflight {

/// Where other ROS 2 nodes are looked for.
struct DiscoverySettings {
  enum class Range { kOff, kLocalhost, kSubnet };
  std::uint32_t domain = 0;
  Range range = Range::kSubnet;
  std::vector<std::string> static_peers;  ///< Addresses.
  bool old_gids = false;                  ///< Graph messages as Humble and older write them.
};

/// What ROS 2's own environment asks for: ROS_DOMAIN_ID, ROS_AUTOMATIC_DISCOVERY_RANGE,
/// ROS_STATIC_PEERS, ROS_LOCALHOST_ONLY, ROS_DISTRO. `get` returns a variable or nothing. Throws
/// std::runtime_error if a value means nothing.
DiscoverySettings discovery_from(
    const std::function<std::optional<std::string>(const char* name)>& get);

/// Cyclone DDS' configuration for it. What `user` says (CYCLONEDDS_URI: files or XML, separated by
/// commas) goes before ours, as with ROS 2's own nodes; its interfaces take the place of ours.
std::string cyclone_configuration(const DiscoverySettings& settings, const std::string& user);

}  // namespace pointflight
