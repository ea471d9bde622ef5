#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pointflight/ros/common/profile.hpp"
#include "pointflight/ros/common/wire.hpp"
#include "pointflight/run/order.hpp"

namespace pointflight {

/// A service of std_srvs that does what an input does, under the name of its topic.
struct ServiceType {
  const char* type;               ///< "Trigger"
  const char* md5;                ///< Of the service as a whole, as ROS 1 compares it.
  std::string (*request_hash)();  ///< For ROS 2.
  /// Nothing if the request is malformed.
  std::optional<Order> (*read)(Wire wire, const Received& request);
};

/// Pause, step and reset.
///@{
extern const ServiceType kPauseService, kStepService, kResetService;
///@}

/// What the run answers; none if the profile has no such topics.
std::vector<Service> run_services(const RosProfile& profile);

/// The order in a request of one of them; nothing if it is malformed.
std::optional<Order> order_in(const Service& service, Wire wire, const Received& request);

/// The answer to a request.
std::vector<std::byte> answer_to(bool taken, Wire wire);

}  // namespace pointflight
