// rosbag2's files of SQLite (.db3), read: ROS 2's default up to Humble.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pointflight/core/progress.hpp"
#include "pointflight/ros/common/wire.hpp"

namespace pointflight {

/// The messages of several files as one, file after file, each in the order of time; of these
/// topics only, of all without any. Nothing is written beside a file. Throws InputError if one is
/// no rosbag2 file or is damaged; a file that was cut is read as far as SQLite can.
std::unique_ptr<MessageReader> open_sqlite(const std::vector<std::string>& paths,
                                           const std::vector<std::string>& topics,
                                           const Progress& progress = {});

/// What is in a file, by counting. Throws InputError as above.
RecordingInfo read_sqlite(const std::string& path, const Progress& progress = {});

}  // namespace pointflight
