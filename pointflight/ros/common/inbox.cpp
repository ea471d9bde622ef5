// The inbox: from the threads of transports to the one that flies.
#include <utility>

#include "pointflight/core/constants.hpp"
#include "pointflight/ros/common/inputs.hpp"
#include "pointflight/ros/common/services.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kOrdersMax = 10000;  // that wait; older ones go

}  // namespace

Inbox::Inbox(const RunDescription& run, const RosProfile& profile)
    : streams_(input_streams(run, profile)) {
  // a shared run's services are those of the process that flies the first vehicle
  if (run.vehicles.front().own) services_ = run_services(profile);
  for (std::size_t v = 0; v < run.vehicles.size(); ++v) {
    const VehicleSettings& s = run.vehicles[v].settings;
    OrderContext& context = contexts_.emplace_back();
    context.vehicle = v;
    context.mass = s.mass;
    context.thrust_max = s.thrust_to_weight() * s.mass * kGravity;
    context.motion = run.vehicles[v].setup.mission.motion;
    context.world_frame = bare_frame(profile.world_frame);
    context.world_alias = bare_frame(profile.world_alias);
    context.map_frame = map_frame_for(run.map->bounds_world(), profile);
    context.body_frame =
        bare_frame(body_frame_of(profile, names_of(profile, run.vehicles[v].setup, v), v));
    if (run.vehicles[v].own) own_contexts_.push_back(context);
  }
}

void Inbox::connect(Transport& transport) {
  const Wire wire = transport.wire();
  for (const InputStream& stream : streams_) {
    transport.subscribe(stream.topic, [this, &stream, wire](const Received& received) {
      receive(stream, wire, received);
    });
  }
  for (const Service& service : services_) {
    transport.serve(service, [this, &service, wire](const Received& request) {
      const auto order = order_in(service, wire, request);
      if (order) push({*order});
      return answer_to(order.has_value(), wire);
    });
  }
}

void Inbox::push(std::vector<Order> orders) {
  const std::lock_guard lock(mutex_);
  for (Order& order : orders) {
    if (orders_.size() >= kOrdersMax) orders_.erase(orders_.begin());
    orders_.push_back(std::move(order));
  }
}

void Inbox::receive(const InputStream& stream, Wire wire, const Received& received) {
  std::string reason;
  const auto all = std::span<const OrderContext>(contexts_);
  const auto own = std::span<const OrderContext>(own_contexts_);
  push(orders_of(
      stream, wire, received, stream.for_all ? own : all.subspan(stream.vehicle, 1), reason));
  if (reason.empty()) return;
  const std::lock_guard lock(mutex_);
  ++refused_.count;
  refused_.last = reason;
  if (refused_topics_.insert(stream.topic.name).second) new_reasons_.push_back(reason);
}

std::vector<Order> Inbox::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(orders_, {});
}

Inbox::Refused Inbox::refused() const {
  const std::lock_guard lock(mutex_);
  return refused_;
}

std::vector<std::string> Inbox::take_new_reasons() {
  const std::lock_guard lock(mutex_);
  return std::exchange(new_reasons_, {});
}

}  // namespace pointflight
