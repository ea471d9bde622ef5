#pragma once

#include <string>

namespace pointflight {

/// Where the master is, as roscpp takes it: ROS_MASTER_URI, or ROS' default if that is not set.
/// Throws std::runtime_error with words for the user if it is no "http://HOST:PORT": roscpp
/// itself would end the process.
std::string checked_master_uri(const char* variable);

}  // namespace pointflight
