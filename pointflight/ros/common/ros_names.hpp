// What names ROS takes.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>

namespace pointflight {

/// Letters, digits and _: what a part of a topic or a node's name may hold.
inline bool is_ros_word(std::string_view word) {
  return !word.empty() && std::all_of(word.begin(), word.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  });
}

/// The same text if what ROS does not take is replaced by _.
inline std::string as_ros_word(std::string text) {
  for (char& c : text) {
    if (!is_ros_word({&c, 1})) c = '_';
  }
  return text;
}

/// Why no ROS takes a topic's name ("/quad_0/imu"; a leading / may be left out); empty if it
/// does. `ros2`: also what only ROS 2 refuses.
inline std::string topic_fault(std::string_view topic, bool ros2 = false) {
  if (!topic.empty() && topic.front() == '/') topic.remove_prefix(1);
  while (true) {
    const auto slash = topic.find('/');
    const std::string_view word = topic.substr(0, slash);
    if (!is_ros_word(word)) {
      return word.empty() ? "has an empty part"
                          : "has '" + std::string(word) + "' in it; letters, digits and _ only";
    }
    if (ros2 && word.front() >= '0' && word.front() <= '9') {
      return "has '" + std::string(word) + "' in it, which ROS 2 does not let begin with a digit";
    }
    if (slash == std::string_view::npos) return {};
    topic.remove_prefix(slash + 1);
  }
}

/// Why tf takes no frame of this name; empty if it does.
inline std::string frame_fault(std::string_view frame) {
  if (!frame.empty() && frame.front() == '/') return "begins with /, which tf2 does not take";
  const bool plain = std::all_of(frame.begin(), frame.end(), [](char c) {
    return is_ros_word({&c, 1}) || c == '/' || c == '-' || c == '.';
  });
  return plain ? "" : "has a character that is none of letters, digits, _ / - and .";
}

}  // namespace pointflight
