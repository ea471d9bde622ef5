#include "ros_common/services.hpp"

#include <algorithm>

#include "ros_common/description.hpp"

namespace pointflight {
namespace {

/// A kind of input that is a service as well. The md5 sums are of the service as a whole, as ROS 1
/// compares them.
struct Row {
  const char* kind;
  const char* type;
  const char* md5;
};
constexpr Row kRows[] = {{"pause", "SetBool", "09fb03525b03e7ea1fd3992bafd87e16"},
                         {"step", "Trigger", "937c9679a518e3a18d831e57125ea522"},
                         {"reset", "Trigger", "937c9679a518e3a18d831e57125ea522"}};

template <class M>
std::optional<M> decoded(Wire wire, const Received& request) {
  const std::span bytes(request.data, request.size);
  return wire == Wire::kCdr ? decode<Wire::kCdr, M>(bytes) : decode<Wire::kRos1, M>(bytes);
}

}  // namespace

std::vector<Service> run_services(const RosProfile& profile) {
  std::vector<Service> services;
  for (const RosInput& input : profile.inputs) {
    const auto row = std::find_if(
        std::begin(kRows), std::end(kRows), [&](const Row& r) { return input.kind == r.kind; });
    if (row == std::end(kRows) || input.topic.empty() || input.topic == "-") continue;
    Service service;
    service.kind = row->kind;
    service.name = input.topic.front() == '/' ? input.topic : "/" + input.topic;
    service.package = "std_srvs";
    service.type = row->type;
    service.md5 = row->md5;
    service.request_hash = service.type == "SetBool" ? message_type<msg::SetBoolRequest>().hash
                                                     : message_type<msg::TriggerRequest>().hash;
    service.response_hash = message_type<msg::DoneResponse>().hash;
    services.push_back(std::move(service));
  }
  return services;
}

std::optional<Order> order_in(const Service& service, Wire wire, const Received& request) {
  if (service.kind == "pause") {
    const auto m = decoded<msg::SetBoolRequest>(wire, request);
    return m ? std::optional<Order>(PauseOrder{m->data}) : std::nullopt;
  }
  if (!decoded<msg::TriggerRequest>(wire, request)) return std::nullopt;
  return service.kind == "step" ? Order{StepOrder{}} : Order{ResetOrder{}};
}

std::vector<std::byte> answer_to(bool taken, Wire wire) {
  const msg::DoneResponse answer{taken, taken ? "" : "malformed request"};
  return wire == Wire::kCdr ? encode<Wire::kCdr>(answer) : encode<Wire::kRos1>(answer);
}

}  // namespace pointflight
