#include "pointflight/ros/common/services.hpp"

#include "pointflight/ros/common/description.hpp"
#include "pointflight/ros/common/inputs.hpp"

namespace pointflight {
namespace {

constexpr const char* kSetBool = "09fb03525b03e7ea1fd3992bafd87e16";
constexpr const char* kTrigger = "937c9679a518e3a18d831e57125ea522";

template <class M>
std::optional<M> decoded(Wire wire, const Received& request) {
  const std::span bytes(request.data, request.size);
  return wire == Wire::kCdr ? decode<Wire::kCdr, M>(bytes) : decode<Wire::kRos1, M>(bytes);
}

template <class M>
std::string hash_of() {
  return message_type<M>().hash;
}

std::optional<Order> pause_in(Wire wire, const Received& request) {
  const auto m = decoded<msg::SetBoolRequest>(wire, request);
  return m ? std::optional<Order>(PauseOrder{m->data}) : std::nullopt;
}

template <class O>
std::optional<Order> triggered(Wire wire, const Received& request) {
  return decoded<msg::TriggerRequest>(wire, request) ? std::optional<Order>(O{}) : std::nullopt;
}

}  // namespace

const ServiceType kPauseService{"SetBool", kSetBool, hash_of<msg::SetBoolRequest>, pause_in};
const ServiceType kStepService{
    "Trigger", kTrigger, hash_of<msg::TriggerRequest>, triggered<StepOrder>};
const ServiceType kResetService{
    "Trigger", kTrigger, hash_of<msg::TriggerRequest>, triggered<ResetOrder>};

std::vector<Service> run_services(const RosProfile& profile) {
  std::vector<Service> services;
  for (const RosInput& input : profile.inputs) {
    const InputType* type = input_types().find(input.kind);
    if (type == nullptr || type->service == nullptr || !is_used(input.topic)) continue;
    services.push_back({.kind = type->name,
                        .name = absolute(input.topic),
                        .package = "std_srvs",
                        .type = type->service->type,
                        .md5 = type->service->md5,
                        .request_hash = type->service->request_hash(),
                        .response_hash = hash_of<msg::TriggerResponse>()});
  }
  return services;
}

std::optional<Order> order_in(const Service& service, Wire wire, const Received& request) {
  return input_types().find(service.kind)->service->read(wire, request);
}

std::vector<std::byte> answer_to(bool taken, Wire wire) {
  const msg::TriggerResponse answer{taken, taken ? "" : "malformed request"};
  return wire == Wire::kCdr ? encode<Wire::kCdr>(answer) : encode<Wire::kRos1>(answer);
}

}  // namespace pointflight
