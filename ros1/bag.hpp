#pragma once

#include <memory>
#include <string>

#include "ros_common/wire.hpp"

namespace pointflight {

/// Records into a ROS 1 bag by Debian's library: `NAME.active` until it is closed, then `NAME`.
/// After a kill whole chunks come back by `rosbag reindex`.
std::unique_ptr<Outlet> make_bag_writer(const std::string& path, const std::string& compression);

/// What is in a bag. Throws std::runtime_error with words for the user.
RecordingInfo read_bag(const std::string& path);

}  // namespace pointflight
