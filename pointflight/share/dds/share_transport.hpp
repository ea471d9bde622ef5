#pragma once

#include <memory>

#include "pointflight/share/share_transport.hpp"

namespace pointflight {

/// A participant of DDS with four topics, "pointflight/NAME/crew", "/states", "/clock" and "/past",
/// in a domain of its own: POINTFLIGHT_DOMAIN_ID, or ROS_DOMAIN_ID + 50 modulo 100, so that ROS'
/// nodes do not hear of it. Where it looks for others is what ROS_AUTOMATIC_DISCOVERY_RANGE,
/// ROS_STATIC_PEERS, ROS_LOCALHOST_ONLY and CYCLONEDDS_URI say. Throws std::runtime_error with
/// words for the user.
std::unique_ptr<ShareTransport> make_dds_share_transport(const ShareTransportOptions& options);

}  // namespace pointflight
