#pragma once

#include <optional>
#include <vector>

#include "ros_common/inputs.hpp"

namespace pointflight {

/// What the run answers: pause, step and reset, under the names of the topics that ask for the
/// same. None where the profile has no such topics.
std::vector<Service> run_services(const RosProfile& profile);

/// The order in a request of one of them; nothing where it is malformed.
std::optional<Order> order_in(const Service& service, Wire wire, const Received& request);

/// The answer to a request.
std::vector<std::byte> answer_to(bool taken, Wire wire);

}  // namespace pointflight
