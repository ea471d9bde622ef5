#include "pointflight/ros/ros2/discovery.hpp"

#include <unistd.h>

#include <fstream>
#include <iterator>
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

namespace {

/// As an attribute's value.
std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

/// True if a user's configuration, XML or files with it, selects network interfaces: DDS refuses
/// one that is selected twice.
bool selects_interfaces(const std::string& user) {
  constexpr const char* kElement = "<NetworkInterface";
  if (user.find(kElement) != std::string::npos) return true;
  std::istringstream parts(user);
  for (std::string path; std::getline(parts, path, ',');) {
    const std::string scheme = "file://";
    if (path.rfind(scheme, 0) == 0) path.erase(0, scheme.size());
    std::ifstream file(path);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    if (text.find(kElement) != std::string::npos) return true;
  }
  return false;
}

}  // namespace

std::string cyclone_configuration(const DiscoverySettings& settings, const std::string& user) {
  using Range = DiscoverySettings::Range;
  std::ostringstream xml;
  // fragments of 64 kB: the kernel's cost of a message is that of its packets (INTEROP: smaller
  // ones lost more into stock receive buffers, even paced)
  xml << "<CycloneDDS><Domain Id=\"any\"><General>"
      << "<MaxMessageSize>65500 B</MaxMessageSize><FragmentSize>64000 B</FragmentSize>";
  if (settings.range == Range::kLocalhost && !selects_interfaces(user)) {
    xml << "<Interfaces><NetworkInterface address=\"127.0.0.1\"/></Interfaces>";
  }
  if (settings.range != Range::kSubnet) xml << "<AllowMulticast>false</AllowMulticast>";
  xml << "</General><Discovery>";
  std::vector<std::string> peers = settings.static_peers;
  if (settings.range == Range::kLocalhost) peers.emplace_back("127.0.0.1");
  if (settings.range == Range::kOff) {
    // a domain of its own within the domain
    xml << "<ParticipantIndex>none</ParticipantIndex><Tag>off_" << getpid() << "</Tag>";
    peers.clear();
  } else {
    // a known port, so that others can name this machine as a peer; each port up to the last is
    // asked at each peer
    xml << "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>"
        << (peers.empty() ? 119 : 32) << "</MaxAutoParticipantIndex>";
  }
  if (!peers.empty()) {
    xml << "<Peers>";
    for (const std::string& peer : peers) xml << "<Peer address=\"" << escaped(peer) << "\"/>";
    xml << "</Peers>";
  }
  // found within a second by who missed the first announcement
  xml << "<SPDPInterval>1 s</SPDPInterval></Discovery><Internal>"
      << "<SocketReceiveBufferSize max=\"4 MiB\"/>"
      // each writer in turn waits so long for a reader that has stopped, when the node ends
      << "<WriterLingerDuration>50 ms</WriterLingerDuration></Internal></Domain></CycloneDDS>";
  return user.empty() ? xml.str() : xml.str() + "," + user;
}

}  // namespace pointflight
