#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pointflight/ros/common/wire.hpp"

namespace pointflight {

/// Records into a ROS 1 bag by Debian's library: `NAME.active` until it is closed, then `NAME`.
/// After a kill whole chunks come back by `rosbag reindex`.
std::unique_ptr<Outlet> make_bag_writer(const std::string& path, const std::string& compression);

/// What is in a bag. Throws std::runtime_error with words for the user.
RecordingInfo read_bag(const std::string& path);

/// Its messages of these topics by their times, of all without any. Throws as above, also later.
std::unique_ptr<MessageReader> read_bag_messages(const std::string& path,
                                                 const std::vector<std::string>& topics);

}  // namespace pointflight
