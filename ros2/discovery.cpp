#include "ros2/discovery.hpp"

#include <sstream>
#include <stdexcept>

namespace pointflight {

DiscoverySettings discovery_from(
    const std::function<std::optional<std::string>(const char* name)>& get) {
  DiscoverySettings settings;
  const auto value = [&](const char* name) { return get(name).value_or(""); };
  if (const std::string domain = value("ROS_DOMAIN_ID"); !domain.empty()) {
    std::size_t end = 0;
    unsigned long number = 0;
    try {
      number = std::stoul(domain, &end);
    } catch (const std::exception&) {
      end = 0;
    }
    if (end != domain.size() || number > 232) {
      throw std::runtime_error("ROS_DOMAIN_ID: '" + domain + "'; a number from 0 to 232");
    }
    settings.domain = static_cast<std::uint32_t>(number);
  }
  // the newer variable goes before the older one, as in ROS 2 itself
  const std::string range = value("ROS_AUTOMATIC_DISCOVERY_RANGE");
  const std::string localhost = value("ROS_LOCALHOST_ONLY");
  if (range == "OFF") {
    settings.range = DiscoverySettings::Range::kOff;
  } else if (range == "LOCALHOST") {
    settings.range = DiscoverySettings::Range::kLocalhost;
  } else if (range.empty() || range == "SUBNET" || range == "SYSTEM_DEFAULT") {
    settings.range = DiscoverySettings::Range::kSubnet;
  } else {
    throw std::runtime_error("ROS_AUTOMATIC_DISCOVERY_RANGE: '" + range +
                             "'; SUBNET, LOCALHOST or OFF");
  }
  if (localhost == "1") {
    settings.range = DiscoverySettings::Range::kLocalhost;
  } else {
    std::istringstream peers(value("ROS_STATIC_PEERS"));
    for (std::string peer; std::getline(peers, peer, ';');) {
      if (!peer.empty()) settings.static_peers.push_back(peer);
    }
  }
  const std::string distribution = value("ROS_DISTRO");
  settings.old_gids =
      distribution == "humble" || distribution == "galactic" || distribution == "foxy";
  return settings;
}

}  // namespace pointflight
