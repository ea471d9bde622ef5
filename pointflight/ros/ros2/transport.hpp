#pragma once

#include <memory>

#include "pointflight/ros/common/wire.hpp"

namespace pointflight {

/// A participant of DDS that other ROS 2 nodes see as a node. Throws std::runtime_error with words
/// for the user.
std::unique_ptr<Transport> make_ros2_transport(const TransportOptions& options);

}  // namespace pointflight
