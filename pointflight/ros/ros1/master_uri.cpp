#include "pointflight/ros/ros1/master_uri.hpp"

#include <algorithm>
#include <stdexcept>

namespace pointflight {

std::string checked_master_uri(const char* variable) {
  if (variable == nullptr) return "http://localhost:11311";
  const std::string uri = variable;
  const std::string scheme = "http://";
  const auto refuse = [&](const std::string& why) {
    throw std::runtime_error("ROS_MASTER_URI: '" + uri + "' " + why +
                             "; give http://HOST:PORT, such as http://localhost:11311");
  };
  if (uri.rfind(scheme, 0) != 0) refuse("does not begin with http://");
  const std::string rest = uri.substr(scheme.size());
  const auto colon = rest.find(':');
  if (colon == std::string::npos) refuse("has no port");
  const std::string host = rest.substr(0, colon);
  const auto is_of_host = [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '.' ||
           c == '-' || c == '_';
  };
  if (host.empty() || !std::all_of(host.begin(), host.end(), is_of_host)) refuse("has no host");
  std::string port = rest.substr(colon + 1);
  if (!port.empty() && port.back() == '/') port.pop_back();
  const bool digits =
      !port.empty() && port.size() <= 5 &&
      std::all_of(port.begin(), port.end(), [](char c) { return c >= '0' && c <= '9'; });
  const int number = digits ? std::stoi(port) : 0;
  if (number < 1 || number > 65535) refuse("has no port from 1 to 65535");
  return uri;
}

}  // namespace pointflight
